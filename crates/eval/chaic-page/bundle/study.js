"use strict";(()=>{var re=Object.defineProperty;var ne=Object.getOwnPropertyDescriptor;var h=(n,e,t,i)=>{for(var s=i>1?void 0:i?ne(e,t):e,r=n.length-1,o;r>=0;r--)(o=n[r])&&(s=(i?o(e,t,s):o(s))||s);return i&&s&&re(e,t,s),s};var Y=globalThis,V=Y.ShadowRoot&&(Y.ShadyCSS===void 0||Y.ShadyCSS.nativeShadow)&&"adoptedStyleSheets"in Document.prototype&&"replace"in CSSStyleSheet.prototype,dt=Symbol(),$t=new WeakMap,I=class{constructor(e,t,i){if(this._$cssResult$=!0,i!==dt)throw Error("CSSResult is not constructable. Use `unsafeCSS` or `css` instead.");this.cssText=e,this.t=t}get styleSheet(){let e=this.o,t=this.t;if(V&&e===void 0){let i=t!==void 0&&t.length===1;i&&(e=$t.get(t)),e===void 0&&((this.o=e=new CSSStyleSheet).replaceSync(this.cssText),i&&$t.set(t,e))}return e}toString(){return this.cssText}},wt=n=>new I(typeof n=="string"?n:n+"",void 0,dt),ct=(n,...e)=>{let t=n.length===1?n[0]:e.reduce((i,s,r)=>i+(o=>{if(o._$cssResult$===!0)return o.cssText;if(typeof o=="number")return o;throw Error("Value passed to 'css' function must be a 'css' function result: "+o+". Use 'unsafeCSS' to pass non-literal values, but take care to ensure page security.")})(s)+n[r+1],n[0]);return new I(t,n,dt)},_t=(n,e)=>{if(V)n.adoptedStyleSheets=e.map(t=>t instanceof CSSStyleSheet?t:t.styleSheet);else for(let t of e){let i=document.createElement("style"),s=Y.litNonce;s!==void 0&&i.setAttribute("nonce",s),i.textContent=t.cssText,n.appendChild(i)}},ht=V?n=>n:n=>n instanceof CSSStyleSheet?(e=>{let t="";for(let i of e.cssRules)t+=i.cssText;return wt(t)})(n):n;var{is:oe,defineProperty:ae,getOwnPropertyDescriptor:le,getOwnPropertyNames:de,getOwnPropertySymbols:ce,getPrototypeOf:he}=Object,K=globalThis,St=K.trustedTypes,pe=St?St.emptyScript:"",ue=K.reactiveElementPolyfillSupport,N=(n,e)=>n,U={toAttribute(n,e){switch(e){case Boolean:n=n?pe:null;break;case Object:case Array:n=n==null?n:JSON.stringify(n)}return n},fromAttribute(n,e){let t=n;switch(e){case Boolean:t=n!==null;break;case Number:t=n===null?null:Number(n);break;case Object:case Array:try{t=JSON.parse(n)}catch{t=null}}return t}},G=(n,e)=>!oe(n,e),At={attribute:!0,type:String,converter:U,reflect:!1,useDefault:!1,hasChanged:G};Symbol.metadata??=Symbol("metadata"),K.litPropertyMetadata??=new WeakMap;var $=class extends HTMLElement{static addInitializer(e){this._$Ei(),(this.l??=[]).push(e)}static get observedAttributes(){return this.finalize(),this._$Eh&&[...this._$Eh.keys()]}static createProperty(e,t=At){if(t.state&&(t.attribute=!1),this._$Ei(),this.prototype.hasOwnProperty(e)&&((t=Object.create(t)).wrapped=!0),this.elementProperties.set(e,t),!t.noAccessor){let i=Symbol(),s=this.getPropertyDescriptor(e,i,t);s!==void 0&&ae(this.prototype,e,s)}}static getPropertyDescriptor(e,t,i){let{get:s,set:r}=le(this.prototype,e)??{get(){return this[t]},set(o){this[t]=o}};return{get:s,set(o){let l=s?.call(this);r?.call(this,o),this.requestUpdate(e,l,i)},configurable:!0,enumerable:!0}}static getPropertyOptions(e){return this.elementProperties.get(e)??At}static _$Ei(){if(this.hasOwnProperty(N("elementProperties")))return;let e=he(this);e.finalize(),e.l!==void 0&&(this.l=[...e.l]),this.elementProperties=new Map(e.elementProperties)}static finalize(){if(this.hasOwnProperty(N("finalized")))return;if(this.finalized=!0,this._$Ei(),this.hasOwnProperty(N("properties"))){let t=this.properties,i=[...de(t),...ce(t)];for(let s of i)this.createProperty(s,t[s])}let e=this[Symbol.metadata];if(e!==null){let t=litPropertyMetadata.get(e);if(t!==void 0)for(let[i,s]of t)this.elementProperties.set(i,s)}this._$Eh=new Map;for(let[t,i]of this.elementProperties){let s=this._$Eu(t,i);s!==void 0&&this._$Eh.set(s,t)}this.elementStyles=this.finalizeStyles(this.styles)}static finalizeStyles(e){let t=[];if(Array.isArray(e)){let i=new Set(e.flat(1/0).reverse());for(let s of i)t.unshift(ht(s))}else e!==void 0&&t.push(ht(e));return t}static _$Eu(e,t){let i=t.attribute;return i===!1?void 0:typeof i=="string"?i:typeof e=="string"?e.toLowerCase():void 0}constructor(){super(),this._$Ep=void 0,this.isUpdatePending=!1,this.hasUpdated=!1,this._$Em=null,this._$Ev()}_$Ev(){this._$ES=new Promise(e=>this.enableUpdating=e),this._$AL=new Map,this._$E_(),this.requestUpdate(),this.constructor.l?.forEach(e=>e(this))}addController(e){(this._$EO??=new Set).add(e),this.renderRoot!==void 0&&this.isConnected&&e.hostConnected?.()}removeController(e){this._$EO?.delete(e)}_$E_(){let e=new Map,t=this.constructor.elementProperties;for(let i of t.keys())this.hasOwnProperty(i)&&(e.set(i,this[i]),delete this[i]);e.size>0&&(this._$Ep=e)}createRenderRoot(){let e=this.shadowRoot??this.attachShadow(this.constructor.shadowRootOptions);return _t(e,this.constructor.elementStyles),e}connectedCallback(){this.renderRoot??=this.createRenderRoot(),this.enableUpdating(!0),this._$EO?.forEach(e=>e.hostConnected?.())}enableUpdating(e){}disconnectedCallback(){this._$EO?.forEach(e=>e.hostDisconnected?.())}attributeChangedCallback(e,t,i){this._$AK(e,i)}_$ET(e,t){let i=this.constructor.elementProperties.get(e),s=this.constructor._$Eu(e,i);if(s!==void 0&&i.reflect===!0){let r=(i.converter?.toAttribute!==void 0?i.converter:U).toAttribute(t,i.type);this._$Em=e,r==null?this.removeAttribute(s):this.setAttribute(s,r),this._$Em=null}}_$AK(e,t){let i=this.constructor,s=i._$Eh.get(e);if(s!==void 0&&this._$Em!==s){let r=i.getPropertyOptions(s),o=typeof r.converter=="function"?{fromAttribute:r.converter}:r.converter?.fromAttribute!==void 0?r.converter:U;this._$Em=s;let l=o.fromAttribute(t,r.type);this[s]=l??this._$Ej?.get(s)??l,this._$Em=null}}requestUpdate(e,t,i,s=!1,r){if(e!==void 0){let o=this.constructor;if(s===!1&&(r=this[e]),i??=o.getPropertyOptions(e),!((i.hasChanged??G)(r,t)||i.useDefault&&i.reflect&&r===this._$Ej?.get(e)&&!this.hasAttribute(o._$Eu(e,i))))return;this.C(e,t,i)}this.isUpdatePending===!1&&(this._$ES=this._$EP())}C(e,t,{useDefault:i,reflect:s,wrapped:r},o){i&&!(this._$Ej??=new Map).has(e)&&(this._$Ej.set(e,o??t??this[e]),r!==!0||o!==void 0)||(this._$AL.has(e)||(this.hasUpdated||i||(t=void 0),this._$AL.set(e,t)),s===!0&&this._$Em!==e&&(this._$Eq??=new Set).add(e))}async _$EP(){this.isUpdatePending=!0;try{await this._$ES}catch(t){Promise.reject(t)}let e=this.scheduleUpdate();return e!=null&&await e,!this.isUpdatePending}scheduleUpdate(){return this.performUpdate()}performUpdate(){if(!this.isUpdatePending)return;if(!this.hasUpdated){if(this.renderRoot??=this.createRenderRoot(),this._$Ep){for(let[s,r]of this._$Ep)this[s]=r;this._$Ep=void 0}let i=this.constructor.elementProperties;if(i.size>0)for(let[s,r]of i){let{wrapped:o}=r,l=this[s];o!==!0||this._$AL.has(s)||l===void 0||this.C(s,void 0,r,l)}}let e=!1,t=this._$AL;try{e=this.shouldUpdate(t),e?(this.willUpdate(t),this._$EO?.forEach(i=>i.hostUpdate?.()),this.update(t)):this._$EM()}catch(i){throw e=!1,this._$EM(),i}e&&this._$AE(t)}willUpdate(e){}_$AE(e){this._$EO?.forEach(t=>t.hostUpdated?.()),this.hasUpdated||(this.hasUpdated=!0,this.firstUpdated(e)),this.updated(e)}_$EM(){this._$AL=new Map,this.isUpdatePending=!1}get updateComplete(){return this.getUpdateComplete()}getUpdateComplete(){return this._$ES}shouldUpdate(e){return!0}update(e){this._$Eq&&=this._$Eq.forEach(t=>this._$ET(t,this[t])),this._$EM()}updated(e){}firstUpdated(e){}};$.elementStyles=[],$.shadowRootOptions={mode:"open"},$[N("elementProperties")]=new Map,$[N("finalized")]=new Map,ue?.({ReactiveElement:$}),(K.reactiveElementVersions??=[]).push("2.1.2");var ut=globalThis,xt=n=>n,J=ut.trustedTypes,Et=J?J.createPolicy("lit-html",{createHTML:n=>n}):void 0,mt="$lit$",w=`lit$${Math.random().toFixed(9).slice(2)}$`,ft="?"+w,me=`<${ft}>`,E=document,D=()=>E.createComment(""),B=n=>n===null||typeof n!="object"&&typeof n!="function",gt=Array.isArray,Ct=n=>gt(n)||typeof n?.[Symbol.iterator]=="function",pt=`[ 	
\f\r]`,H=/<(?:(!--|\/[^a-zA-Z])|(\/?[a-zA-Z][^>\s]*)|(\/?$))/g,Tt=/-->/g,kt=/>/g,A=RegExp(`>|${pt}(?:([^\\s"'>=/]+)(${pt}*=${pt}*(?:[^ 	
\f\r"'\`<>=]|("|')|))|$)`,"g"),Rt=/'/g,Pt=/"/g,Mt=/^(?:script|style|textarea|title)$/i,vt=n=>(e,...t)=>({_$litType$:n,strings:e,values:t}),d=vt(1),Ue=vt(2),He=vt(3),T=Symbol.for("lit-noChange"),p=Symbol.for("lit-nothing"),Lt=new WeakMap,x=E.createTreeWalker(E,129);function Ot(n,e){if(!gt(n)||!n.hasOwnProperty("raw"))throw Error("invalid template strings array");return Et!==void 0?Et.createHTML(e):e}var It=(n,e)=>{let t=n.length-1,i=[],s,r=e===2?"<svg>":e===3?"<math>":"",o=H;for(let l=0;l<t;l++){let a=n[l],c,f,u=-1,b=0;for(;b<a.length&&(o.lastIndex=b,f=o.exec(a),f!==null);)b=o.lastIndex,o===H?f[1]==="!--"?o=Tt:f[1]!==void 0?o=kt:f[2]!==void 0?(Mt.test(f[2])&&(s=RegExp("</"+f[2],"g")),o=A):f[3]!==void 0&&(o=A):o===A?f[0]===">"?(o=s??H,u=-1):f[1]===void 0?u=-2:(u=o.lastIndex-f[2].length,c=f[1],o=f[3]===void 0?A:f[3]==='"'?Pt:Rt):o===Pt||o===Rt?o=A:o===Tt||o===kt?o=H:(o=A,s=void 0);let _=o===A&&n[l+1].startsWith("/>")?" ":"";r+=o===H?a+me:u>=0?(i.push(c),a.slice(0,u)+mt+a.slice(u)+w+_):a+w+(u===-2?l:_)}return[Ot(n,r+(n[t]||"<?>")+(e===2?"</svg>":e===3?"</math>":"")),i]},j=class n{constructor({strings:e,_$litType$:t},i){let s;this.parts=[];let r=0,o=0,l=e.length-1,a=this.parts,[c,f]=It(e,t);if(this.el=n.createElement(c,i),x.currentNode=this.el.content,t===2||t===3){let u=this.el.content.firstChild;u.replaceWith(...u.childNodes)}for(;(s=x.nextNode())!==null&&a.length<l;){if(s.nodeType===1){if(s.hasAttributes())for(let u of s.getAttributeNames())if(u.endsWith(mt)){let b=f[o++],_=s.getAttribute(u).split(w),z=/([.?@])?(.*)/.exec(b);a.push({type:1,index:r,name:z[2],strings:_,ctor:z[1]==="."?Q:z[1]==="?"?Z:z[1]==="@"?tt:R}),s.removeAttribute(u)}else u.startsWith(w)&&(a.push({type:6,index:r}),s.removeAttribute(u));if(Mt.test(s.tagName)){let u=s.textContent.split(w),b=u.length-1;if(b>0){s.textContent=J?J.emptyScript:"";for(let _=0;_<b;_++)s.append(u[_],D()),x.nextNode(),a.push({type:2,index:++r});s.append(u[b],D())}}}else if(s.nodeType===8)if(s.data===ft)a.push({type:2,index:r});else{let u=-1;for(;(u=s.data.indexOf(w,u+1))!==-1;)a.push({type:7,index:r}),u+=w.length-1}r++}}static createElement(e,t){let i=E.createElement("template");return i.innerHTML=e,i}};function k(n,e,t=n,i){if(e===T)return e;let s=i!==void 0?t._$Co?.[i]:t._$Cl,r=B(e)?void 0:e._$litDirective$;return s?.constructor!==r&&(s?._$AO?.(!1),r===void 0?s=void 0:(s=new r(n),s._$AT(n,t,i)),i!==void 0?(t._$Co??=[])[i]=s:t._$Cl=s),s!==void 0&&(e=k(n,s._$AS(n,e.values),s,i)),e}var X=class{constructor(e,t){this._$AV=[],this._$AN=void 0,this._$AD=e,this._$AM=t}get parentNode(){return this._$AM.parentNode}get _$AU(){return this._$AM._$AU}u(e){let{el:{content:t},parts:i}=this._$AD,s=(e?.creationScope??E).importNode(t,!0);x.currentNode=s;let r=x.nextNode(),o=0,l=0,a=i[0];for(;a!==void 0;){if(o===a.index){let c;a.type===2?c=new C(r,r.nextSibling,this,e):a.type===1?c=new a.ctor(r,a.name,a.strings,this,e):a.type===6&&(c=new et(r,this,e)),this._$AV.push(c),a=i[++l]}o!==a?.index&&(r=x.nextNode(),o++)}return x.currentNode=E,s}p(e){let t=0;for(let i of this._$AV)i!==void 0&&(i.strings!==void 0?(i._$AI(e,i,t),t+=i.strings.length-2):i._$AI(e[t])),t++}},C=class n{get _$AU(){return this._$AM?._$AU??this._$Cv}constructor(e,t,i,s){this.type=2,this._$AH=p,this._$AN=void 0,this._$AA=e,this._$AB=t,this._$AM=i,this.options=s,this._$Cv=s?.isConnected??!0}get parentNode(){let e=this._$AA.parentNode,t=this._$AM;return t!==void 0&&e?.nodeType===11&&(e=t.parentNode),e}get startNode(){return this._$AA}get endNode(){return this._$AB}_$AI(e,t=this){e=k(this,e,t),B(e)?e===p||e==null||e===""?(this._$AH!==p&&this._$AR(),this._$AH=p):e!==this._$AH&&e!==T&&this._(e):e._$litType$!==void 0?this.$(e):e.nodeType!==void 0?this.T(e):Ct(e)?this.k(e):this._(e)}O(e){return this._$AA.parentNode.insertBefore(e,this._$AB)}T(e){this._$AH!==e&&(this._$AR(),this._$AH=this.O(e))}_(e){this._$AH!==p&&B(this._$AH)?this._$AA.nextSibling.data=e:this.T(E.createTextNode(e)),this._$AH=e}$(e){let{values:t,_$litType$:i}=e,s=typeof i=="number"?this._$AC(e):(i.el===void 0&&(i.el=j.createElement(Ot(i.h,i.h[0]),this.options)),i);if(this._$AH?._$AD===s)this._$AH.p(t);else{let r=new X(s,this),o=r.u(this.options);r.p(t),this.T(o),this._$AH=r}}_$AC(e){let t=Lt.get(e.strings);return t===void 0&&Lt.set(e.strings,t=new j(e)),t}k(e){gt(this._$AH)||(this._$AH=[],this._$AR());let t=this._$AH,i,s=0;for(let r of e)s===t.length?t.push(i=new n(this.O(D()),this.O(D()),this,this.options)):i=t[s],i._$AI(r),s++;s<t.length&&(this._$AR(i&&i._$AB.nextSibling,s),t.length=s)}_$AR(e=this._$AA.nextSibling,t){for(this._$AP?.(!1,!0,t);e!==this._$AB;){let i=xt(e).nextSibling;xt(e).remove(),e=i}}setConnected(e){this._$AM===void 0&&(this._$Cv=e,this._$AP?.(e))}},R=class{get tagName(){return this.element.tagName}get _$AU(){return this._$AM._$AU}constructor(e,t,i,s,r){this.type=1,this._$AH=p,this._$AN=void 0,this.element=e,this.name=t,this._$AM=s,this.options=r,i.length>2||i[0]!==""||i[1]!==""?(this._$AH=Array(i.length-1).fill(new String),this.strings=i):this._$AH=p}_$AI(e,t=this,i,s){let r=this.strings,o=!1;if(r===void 0)e=k(this,e,t,0),o=!B(e)||e!==this._$AH&&e!==T,o&&(this._$AH=e);else{let l=e,a,c;for(e=r[0],a=0;a<r.length-1;a++)c=k(this,l[i+a],t,a),c===T&&(c=this._$AH[a]),o||=!B(c)||c!==this._$AH[a],c===p?e=p:e!==p&&(e+=(c??"")+r[a+1]),this._$AH[a]=c}o&&!s&&this.j(e)}j(e){e===p?this.element.removeAttribute(this.name):this.element.setAttribute(this.name,e??"")}},Q=class extends R{constructor(){super(...arguments),this.type=3}j(e){this.element[this.name]=e===p?void 0:e}},Z=class extends R{constructor(){super(...arguments),this.type=4}j(e){this.element.toggleAttribute(this.name,!!e&&e!==p)}},tt=class extends R{constructor(e,t,i,s,r){super(e,t,i,s,r),this.type=5}_$AI(e,t=this){if((e=k(this,e,t,0)??p)===T)return;let i=this._$AH,s=e===p&&i!==p||e.capture!==i.capture||e.once!==i.once||e.passive!==i.passive,r=e!==p&&(i===p||s);s&&this.element.removeEventListener(this.name,this,i),r&&this.element.addEventListener(this.name,this,e),this._$AH=e}handleEvent(e){typeof this._$AH=="function"?this._$AH.call(this.options?.host??this.element,e):this._$AH.handleEvent(e)}},et=class{constructor(e,t,i){this.element=e,this.type=6,this._$AN=void 0,this._$AM=t,this.options=i}get _$AU(){return this._$AM._$AU}_$AI(e){k(this,e)}},Nt={M:mt,P:w,A:ft,C:1,L:It,R:X,D:Ct,V:k,I:C,H:R,N:Z,U:tt,B:Q,F:et},fe=ut.litHtmlPolyfillSupport;fe?.(j,C),(ut.litHtmlVersions??=[]).push("3.3.3");var Ut=(n,e,t)=>{let i=t?.renderBefore??e,s=i._$litPart$;if(s===void 0){let r=t?.renderBefore??null;i._$litPart$=s=new C(e.insertBefore(D(),r),r,void 0,t??{})}return s._$AI(n),s};var yt=globalThis,y=class extends ${constructor(){super(...arguments),this.renderOptions={host:this},this._$Do=void 0}createRenderRoot(){let e=super.createRenderRoot();return this.renderOptions.renderBefore??=e.firstChild,e}update(e){let t=this.render();this.hasUpdated||(this.renderOptions.isConnected=this.isConnected),super.update(e),this._$Do=Ut(t,this.renderRoot,this.renderOptions)}connectedCallback(){super.connectedCallback(),this._$Do?.setConnected(!0)}disconnectedCallback(){super.disconnectedCallback(),this._$Do?.setConnected(!1)}render(){return T}};y._$litElement$=!0,y.finalized=!0,yt.litElementHydrateSupport?.({LitElement:y});var ge=yt.litElementPolyfillSupport;ge?.({LitElement:y});(yt.litElementVersions??=[]).push("4.2.2");var ve={attribute:!0,type:String,converter:U,reflect:!1,hasChanged:G},ye=(n=ve,e,t)=>{let{kind:i,metadata:s}=t,r=globalThis.litPropertyMetadata.get(s);if(r===void 0&&globalThis.litPropertyMetadata.set(s,r=new Map),i==="setter"&&((n=Object.create(n)).wrapped=!0),r.set(t.name,n),i==="accessor"){let{name:o}=t;return{set(l){let a=e.get.call(this);e.set.call(this,l),this.requestUpdate(o,a,n,!0,l)},init(l){return l!==void 0&&this.C(o,void 0,n,l),l}}}if(i==="setter"){let{name:o}=t;return function(l){let a=this[o];e.call(this,l),this.requestUpdate(o,a,n,!0,l)}}throw Error("Unsupported decorator location: "+i)};function S(n){return(e,t)=>typeof t=="object"?ye(n,e,t):((i,s,r)=>{let o=s.hasOwnProperty(r);return s.constructor.createProperty(r,i),o?Object.getOwnPropertyDescriptor(s,r):void 0})(n,e,t)}function m(n){return S({...n,state:!0,attribute:!1})}var P=(n,e,t)=>(t.configurable=!0,t.enumerable=!0,Reflect.decorate&&typeof e!="object"&&Object.defineProperty(n,e,t),t);function M(n,e){return(t,i,s)=>{let r=o=>o.renderRoot?.querySelector(n)??null;if(e){let{get:o,set:l}=typeof i=="object"?t:s??(()=>{let a=Symbol();return{get(){return this[a]},set(c){this[a]=c}}})();return P(t,i,{get(){let a=o.call(this);return a===void 0&&(a=r(this),(a!==null||this.hasUpdated)&&l.call(this,a)),a}})}return P(t,i,{get(){return r(this)}})}}var Ht=n=>(...e)=>({_$litDirective$:n,values:e}),it=class{constructor(e){}get _$AU(){return this._$AM._$AU}_$AT(e,t,i){this._$Ct=e,this._$AM=t,this._$Ci=i}_$AS(e,t){return this.update(e,t)}update(e,t){return this.render(...t)}};var{I:Ei}=Nt;var be={},Dt=(n,e=be)=>n._$AH=e;var Bt=Ht(class extends it{constructor(){super(...arguments),this.key=p}render(n,e){return this.key=n,e}update(n,[e,t]){return e!==this.key&&(Dt(n),this.key=e),t}});async function bt(n){let e=Uint8Array.from(atob(n.textContent.trim()),i=>i.charCodeAt(0)),t=new Blob([e]).stream().pipeThrough(new DecompressionStream("deflate-raw"));return new Response(t).arrayBuffer()}var jt=()=>bt(document.getElementById("chaic-module")),qt=()=>document.getElementById("chaic-worker").textContent;function Ft(n,e){let t=Math.floor(n/e);return`${Math.floor(t/60)}:${String(t%60).padStart(2,"0")}`}var Wt={view:512,map:720};function zt(n,e){let i=(n?.clientWidth??0)*devicePixelRatio;return Math.min(Math.max(64*Math.ceil(i/64),64),e)}function Yt(n,{width:e,height:t,rgba:i}){let s=n?.getContext("2d");!n||!s||((n.width!==e||n.height!==t)&&(n.width=e,n.height=t),s.putImageData(new ImageData(i,e,t),0,0))}var st=class{constructor(e){this.choices=e;this.timer=0}set(e){clearInterval(this.timer),this.timer=e?window.setInterval(()=>this.next(),1500):0}next(){let e=this.choices(),t=document.activeElement;for(;t?.shadowRoot?.activeElement;)t=t.shadowRoot.activeElement;let i=e.findIndex(s=>s===t);e[(i+1)%e.length]?.focus()}};var Vt=ct`
  :host {
    --ink: #1e2026;
    --faint: #5a5e66;
    --paper: #fafaf8;
    --line: #c9cbce;
    --partner: #b8341c;
    --helper: #0b6e72;
    --child: #8a6400;
    --good: #0f6b34;
    --bad: #a3171d;
    --accent: #174ea6;
    display: block;
    color: var(--ink);
    background: var(--paper);
  }
  @media (prefers-color-scheme: dark) {
    :host {
      --ink: #eceef1;
      --faint: #b4b8bf;
      --paper: #17191d;
      --line: #4a4e55;
      --partner: #ff8f78;
      --helper: #5fd0d4;
      --child: #f0c24a;
      --good: #6fdc98;
      --bad: #ff9d9d;
      --accent: #9cc1ff;
    }
  }
  h2 {
    font-size: 1.25rem;
    margin: 0 0 0.25rem;
  }
  h3 {
    font-size: 1rem;
    margin: 0.75rem 0 0.25rem;
  }
  p {
    margin: 0.25rem 0;
  }
  .small,
  figcaption {
    color: var(--faint);
    font-size: 0.875rem;
  }
  .badge {
    border: 2px solid;
    border-radius: 0.25rem;
    font-weight: 600;
    padding: 0 0.375rem;
  }
  .good {
    color: var(--good);
  }
  .bad,
  .problem {
    color: var(--bad);
  }
  .pictures {
    display: grid;
    gap: 0.75rem;
    grid-template-columns: repeat(auto-fit, minmax(min(16rem, 100%), 1fr));
  }
  figure {
    margin: 0;
  }
  figcaption {
    min-height: 3.75em;
    overflow-wrap: anywhere;
  }
  canvas {
    border-radius: 0.25rem;
    display: block;
    height: auto;
    width: 100%;
  }
  figure.a0 canvas {
    border-top: 4px solid var(--partner);
  }
  figure.a1 canvas {
    border-top: 4px double var(--helper);
  }
  .overlaid {
    overflow: hidden;
    position: relative;
  }
  canvas.layers,
  .trails {
    left: 0;
    pointer-events: none;
    position: absolute;
    top: 0;
    width: 100%;
  }
  fieldset.layers {
    border: 1px solid var(--line);
    border-radius: 0.25rem;
    display: flex;
    flex-wrap: wrap;
    gap: 0 1rem;
    margin: 0.5rem 0;
    min-width: 0;
    padding: 0.25rem 0.75rem;
  }
  .layers label {
    align-items: center;
    display: inline-flex;
    gap: 0.375rem;
    min-height: 2rem;
  }
  .layers input {
    accent-color: var(--accent);
    height: 1.25rem;
    margin: 0;
    width: 1.25rem;
  }
  .words {
    overflow-wrap: anywhere;
  }
  .words summary {
    cursor: pointer;
    min-height: 1.75rem;
  }
  .words ul {
    margin: 0;
    padding-left: 1.5rem;
  }
  svg.limits {
    display: block;
    max-width: 26rem;
    width: 100%;
  }
  .limits .region {
    fill: var(--partner);
    fill-opacity: 0.15;
    stroke: var(--partner);
  }
  .limits line {
    stroke: var(--line);
  }
  .limits text {
    fill: var(--ink);
    font-size: 12px;
  }
  .limits text.beyond {
    font-size: 15px;
    font-weight: 700;
  }
  .limits circle {
    fill: var(--ink);
    fill-opacity: 0.7;
  }
  .trails polyline {
    fill: none;
    stroke: var(--agent);
    stroke-width: 0.005px;
  }
  .trails polyline.run1 {
    stroke-dasharray: 0.02px 0.01px;
  }
  .trails circle {
    fill: var(--agent);
    stroke: #fff;
    stroke-width: 0.003px;
  }
  .trails circle.run1 {
    fill: #fff;
    stroke: var(--agent);
  }
  .chart {
    background: linear-gradient(var(--line), var(--line)) 0 50% / 100% 1px no-repeat;
    border: solid var(--line);
    border-width: 1px 0;
    cursor: pointer;
    display: block;
    height: 6rem;
    width: 100%;
  }
  .chart path {
    fill: none;
    stroke: var(--ink);
    stroke-width: 2px;
    vector-effect: non-scaling-stroke;
  }
  .chart path.run1 {
    stroke-dasharray: 6px 4px;
  }
  .chart path.now {
    stroke: var(--accent);
  }
  .plans {
    margin: 0;
    padding-left: 1.5rem;
  }
  .plans button {
    background: transparent;
    border: 1px solid var(--faint);
    border-radius: 0.25rem;
    color: inherit;
    cursor: pointer;
    font: inherit;
    margin: 0.125rem 0;
    min-height: 2.75rem;
    padding: 0.25rem 0.75rem;
    text-align: left;
    width: 100%;
  }
  .link {
    background: none;
    border: 0;
    color: var(--accent);
    cursor: pointer;
    font: inherit;
    min-height: 1.75rem;
    min-width: 1.75rem;
    padding: 0;
    text-decoration: underline;
  }
  .controls {
    align-items: center;
    display: flex;
    flex-wrap: wrap;
    gap: 0.5rem;
    margin: 0.5rem 0;
  }
  .controls button {
    background: transparent;
    border: 1px solid var(--faint);
    border-radius: 0.25rem;
    color: inherit;
    font: inherit;
    height: 2.75rem;
    min-width: 2.75rem;
  }
  .controls svg {
    display: block;
    fill: currentColor;
    height: 1.25rem;
    margin: auto;
    width: 1.25rem;
  }
  .controls select {
    background: var(--paper);
    color: inherit;
    font: inherit;
    height: 2.75rem;
  }
  .seek {
    flex: 1 1 12rem;
  }
  .seek input {
    height: 2.75rem;
    width: 100%;
  }
  .time {
    font-variant-numeric: tabular-nums;
  }
  .hidden {
    clip-path: inset(50%);
    height: 1px;
    overflow: hidden;
    position: absolute;
    width: 1px;
  }
  :focus-visible {
    outline: 3px solid var(--accent);
    outline-offset: 2px;
  }
  .timeline {
    display: grid;
    gap: 0.5rem;
    grid-template-columns: max-content 1fr;
  }
  .labels {
    font-size: 0.875rem;
  }
  .labels span,
  .row {
    display: block;
    height: 1.75rem;
    line-height: 1.75rem;
    position: relative;
  }
  .rows {
    cursor: pointer;
    overflow: hidden;
    position: relative;
    touch-action: pan-y;
  }
  .a0 {
    --agent: var(--partner);
  }
  .a1 {
    --agent: var(--helper);
  }
  .a2 {
    --agent: var(--child);
  }
  .bar {
    background: var(--agent);
    min-width: 1px;
    position: absolute;
    top: 50%;
    transform: translateY(-50%);
  }
  .bar.walk {
    height: 0.625rem;
    opacity: 0.45;
  }
  .bar.interact {
    height: 1.25rem;
  }
  .bar.failed {
    background: none;
    border: 1px solid var(--agent);
    box-sizing: border-box;
    height: 1.25rem;
  }
  .bar.wait {
    height: 3px;
  }
  .mark {
    position: absolute;
    transform: translateX(-50%);
  }
  .row > .mark.a0,
  .row > .mark.a1,
  .row > .mark.a2 {
    color: var(--agent);
  }
  .now {
    background: var(--accent);
    bottom: 0;
    position: absolute;
    top: 0;
    width: 2px;
  }
  @media (forced-colors: active) {
    .bar,
    .now,
    .key {
      forced-color-adjust: none;
    }
  }
  .legend {
    color: var(--faint);
    font-size: 0.875rem;
  }
  .key {
    background: var(--faint);
    display: inline-block;
    margin: 0 0.25rem 0 0.75rem;
    vertical-align: middle;
    width: 1.5rem;
  }
  .key.walk {
    height: 0.5rem;
    opacity: 0.5;
  }
  .key.interact {
    height: 1rem;
  }
  .key.failed {
    background: none;
    border: 1px solid var(--faint);
    height: 1rem;
  }
  .key.wait {
    height: 3px;
  }
  .key.triangle {
    background: none;
    width: auto;
  }
  .columns {
    display: grid;
    gap: 1.5rem;
    grid-template-columns: repeat(auto-fit, minmax(min(20rem, 100%), 1fr));
  }
  .story ol {
    list-style: none;
    margin: 0;
    max-height: 24rem;
    overflow-y: auto;
    padding: 0;
  }
  .story button {
    background: transparent;
    border: 0;
    border-left: 4px solid transparent;
    color: inherit;
    cursor: pointer;
    font: inherit;
    min-height: 2rem;
    padding: 0.125rem 0.5rem;
    text-align: left;
    width: 100%;
  }
  .story button[aria-current="step"] {
    border-left-color: var(--accent);
    font-weight: 600;
  }
  table {
    border-collapse: collapse;
    width: 100%;
  }
  caption {
    font-weight: 600;
    text-align: left;
  }
  th {
    font-weight: 400;
    text-align: left;
  }
  .number {
    font-variant-numeric: tabular-nums;
    text-align: right;
  }
  meter {
    width: 100%;
  }
  .belief td:not(.number) {
    width: 55%;
  }
`;var Kt=512,Gt=["none","rhp","oracle"],Jt=15,v=class extends y{constructor(){super(...arguments);this.workerSource="";this.story=[];this.references=new Map;this.isScanning=!1;this.pointing={kind:"pick_up",hand:"left"};this.isBusy=!1;this.isOver=!1;this.lastTime=0;this.elapsedFrames=0;this.scanTimer=0;this.recordedLength=0;this.recordedFrame=0;this.nTraceRequests=0}static{this.styles=Vt}disconnectedCallback(){super.disconnectedCallback(),this.close()}updated(t){t.has("game")&&this.game&&this.open(this.game)}close(){this.simulator?.close(),this.simulator=void 0,clearInterval(this.scanTimer),this.info=this.shown=this.problem=void 0,this.isScanning=!1,this.story=[],this.references=new Map,this.isOver=!1,this.recordedLength=this.recordedFrame=this.nTraceRequests=0}open(t){this.close();let i=a=>this.receive(a);this.simulator=t.startSimulator?.(i)??this.startWorker(i);let{module:s,episode:r,config:o,branch:l}=t;this.post({type:"play",module:s,episode:r,config:{...o,is_live:t.isLive},branch:l})}startWorker(t){let i=URL.createObjectURL(new Blob([this.workerSource],{type:"text/javascript"})),s=new Worker(i);return URL.revokeObjectURL(i),s.onmessage=r=>t(r.data),s.onerror=r=>this.fail(r.message||"the worker has stopped"),{post:r=>s.postMessage(r),close:()=>s.terminate()}}post(t){this.isBusy=!0,this.simulator?.post(t)}receive(t){switch(this.isBusy=!1,t.type){case"playing":this.info=t.info,this.updateComplete.then(()=>this.begin());break;case"live":this.show(t.state),Yt(this.canvas,t.view);break;case"trace":this.nTraceRequests-=1,this.game?.isStudy&&this.record(t.trace),this.isOver&&this.nTraceRequests===0&&this.finish(t.trace);break;case"reference":this.references=new Map(this.references).set(t.helper,t.rate),this.compareNext();break;case"over":this.isOver=!0,this.dispatchEvent(new CustomEvent("over",{detail:"ended"}));break;case"error":this.fail(t.message);break}}fail(t){this.problem=t,this.game?.isStudy&&this.dispatchEvent(new CustomEvent("over",{detail:"left"}))}begin(){this.lastTime=performance.now(),this.elapsedFrames=1,requestAnimationFrame(t=>this.advance(t))}advance(t){if(!this.simulator||this.problem||this.isOver)return;let i=(this.game?.speed??1)*(this.info?.frames_per_second??0);this.elapsedFrames+=Math.min(t-this.lastTime,250)/1e3*i,this.elapsedFrames=Math.min(this.elapsedFrames,Math.max(i,1)),this.lastTime=t;let s=this.shown?.status==="waiting"&&!this.input&&!this.game?.isLive,r=Math.floor(this.elapsedFrames);if(!this.isBusy&&r>0&&(!s||this.input)){this.elapsedFrames-=r;let o=zt(this.canvas,Wt.view);this.post({type:"advance",frames:r,viewPx:o,input:this.input}),this.input&&(this.recordedFrame=-Jt),this.input=void 0}else s&&(this.elapsedFrames=Math.min(this.elapsedFrames,1));requestAnimationFrame(o=>this.advance(o))}show(t){let i=t.status==="waiting"&&this.shown?.status!=="waiting",s=i?[]:(this.shown?.plans??[]).filter(o=>t.plans.includes(o)),r=t.plans.filter(o=>!s.includes(o));this.shown={...t,plans:[...s,...r]},t.events.length>0&&(this.story=[...this.story,...t.events]),t.status==="ended"?this.stop():this.game?.isStudy&&(i||t.frame-this.recordedFrame>=Jt)&&(this.recordedFrame=t.frame,this.requestTrace()),i&&this.updateComplete.then(()=>this.focusChoices())}focusChoices(){let t=document.activeElement;if(t!==document.body&&t!==this)return;let i=this.shadowRoot?.activeElement;i&&!i.closest(".plans")||this.shadowRoot?.querySelector(".plans button")?.focus()}stop(){this.isOver||(this.isOver=!0,this.requestTrace())}requestTrace(){this.nTraceRequests+=1,this.post({type:"trace"})}record(t){let i=t.slice(this.recordedLength);this.recordedLength=t.length,i&&this.dispatchEvent(new CustomEvent("recorded",{detail:i}))}finish(t){let{episode:i,isStudy:s}=this.game;if(s){let r=this.shown?.status==="ended"?"ended":"stopped";this.dispatchEvent(new CustomEvent("over",{detail:r}));return}this.dispatchEvent(new CustomEvent("finished",{detail:{trace:t,episode:i}})),this.shown?.status==="ended"&&this.compareNext()}compareNext(){let t=Gt.find(i=>!this.references.has(i));t&&this.post({type:"reference",helper:t})}choose(t){let i=this.shown?.plans[t];this.shown?.status==="waiting"&&!this.isOver&&i!==void 0&&(this.input={plan:i})}act(t){this.shown?.status==="waiting"&&(this.input={action:t})}point(t){if(this.game?.config.level!=="steps")return;let i=t.currentTarget.getBoundingClientRect(),s=(c,f)=>Math.max(0,Math.min(Kt-1,Math.floor(c/f*Kt))),r={column:s(t.clientX-i.left,i.width),row:s(t.clientY-i.top,i.height)},{kind:o,hand:l}=this.pointing,a={pick_up:"object",put_on:"place",remove_obstacle:"obstacle"}[o];this.act({[o]:{[a]:{pixel:r},hand:l}})}press(t){let i=t.composedPath()[0];if(t.ctrlKey||t.altKey||t.metaKey||i.matches("select, input"))return;let s=this.game?.config.level==="steps",r=/^[1-9]$/.test(t.key)?Number(t.key)-1:void 0,l=s?{ArrowUp:"move_forward",ArrowLeft:"turn_left",ArrowRight:"turn_right",".":{wait:{frames:10}}}[t.key]:void 0;if(l)this.act(l);else if(!s&&r!==void 0)this.choose(r);else return;t.preventDefault()}scan(t){clearInterval(this.scanTimer),this.isScanning=t,t&&(this.scanTimer=window.setInterval(()=>this.focusNext(),1500))}focusNext(){let t=this.shadowRoot,i=[...t.querySelectorAll(".plans button")],s=i.findIndex(r=>r===t.activeElement);i[(s+1)%i.length]?.focus()}render(){let{info:t,shown:i}=this;return this.problem?d`<p class="problem" role="alert">Cannot play: ${this.problem}</p>`:t?d`<section aria-label="Play" @keydown=${s=>this.press(s)}>
      ${this.heading(t)}
      <div class="columns">
        <figure class="a${this.game?.config.seat??0}">
          <canvas
            class="view"
            width="512"
            height="512"
            role="img"
            aria-label="What you see"
            @click=${s=>this.point(s)}
          ></canvas>
        </figure>
        <div>
          ${i?this.status(i):p}
          ${this.game?.config.level==="plans"?this.plans(i):this.steps(i)}
          ${this.isOver?p:d`<p><button type="button" class="link" @click=${()=>this.stop()}>Stop here</button></p>`}
          ${i?.status==="ended"&&!this.game?.isStudy?this.result(i):p} ${this.events()}
        </div>
      </div>
    </section>`:this.isOver?d``:d`<p role="status">Loading ...</p>`}heading(t){let i=this.game?.config.seat===1,[s,r]=t.reach_m.map(l=>l.toFixed(2)),o=i?"The partner wants something that you do not know. Find out and help.":`Your body: ${t.person}. You want ${t.goal.join(", ")}.`;return d`<header>
      <h2>${t.task}: you are the ${i?"helper":"partner"}</h2>
      <p>${o} You reach from ${s} to ${r} m and lift ${t.strength_kg.toFixed(0)} kg.</p>
      <p class="small">${t.episode?`${t.episode}. `:""}A simulation: real people differ from these bodies and views.</p>
    </header>`}time(t){return Ft(t,this.info?.frames_per_second??1)}status(t){let{action:i,plan:s}=t.caption,r=t.hands.map(l=>l??"nothing"),o=t.progress?`, ${t.progress[0]} of ${t.progress[1]} delivered`:"";return d`<p class="time">
        ${this.time(t.frame)} of ${this.time(t.horizon)}${o}
      </p>
      <p>Left hand: ${r[0]}; right hand: ${r[1]}</p>
      <p role="status">You: ${i}${s?` (${s})`:""}${t.failure?`; failed: ${t.failure}`:""}</p>`}plans(t){return d`<h3>What next?</h3>
      <ol class="plans">
        ${(t?.plans??[]).map((i,s)=>d`<li><button type="button" @click=${()=>this.choose(s)}>${i}</button></li>`)}
      </ol>
      ${t?.status==="running"?d`<p>Doing it ...</p>`:p}
      ${this.game?.isStudy?p:this.scanChoice()}`}scanChoice(){return d`<label>
        <input
          type="checkbox"
          .checked=${this.isScanning}
          @change=${t=>this.scan(t.target.checked)}
        />
        Offer one plan after the other, for a single switch
      </label>`}steps(t){let i=(o,l)=>d`<button type="button" @click=${()=>this.act(l)}>${o}</button>`,s=o=>{let[l,a]=o.target.value.split(" ");this.pointing={kind:l,hand:a}},r=[["pick_up left","picks up with the left hand"],["pick_up right","picks up with the right hand"],["put_on left","puts what the left hand holds there"],["put_on right","puts what the right hand holds there"],["remove_obstacle left","removes an obstacle"]];return d`<div class="controls" role="group" aria-label="Actions">
        ${i("Turn left (left arrow)","turn_left")} ${i("Walk (up arrow)","move_forward")}
        ${i("Turn right (right arrow)","turn_right")} ${i("Put into the container","put_in")}
        ${i("Wait (.)",{wait:{frames:10}})}
      </div>
      <label>
        A click on the picture
        <select @change=${s}>
          ${r.map(([o,l])=>d`<option value=${o}>${l}</option>`)}
        </select>
      </label>
      ${t?.status==="running"?d`<p>Acting ...</p>`:p}`}result(t){let[i,s]=t.progress??[0,0],r=s>0?i/s:0,o=a=>a===void 0?"...":`${(100*a).toFixed(0)} %`,l=this.game?.config.seat===1?"your help":"you as the partner";return d`<h3>Result</h3>
      <table>
        <caption>Delivered part of the goal, same episode and seed</caption>
        <tr><th scope="row">${l}</th><td class="number">${o(r)}</td></tr>
        ${Gt.map(a=>d`<tr>
            <th scope="row">simulated partner, ${a==="none"?"no helper":`helper ${a}`}</th>
            <td class="number">${o(this.references.get(a))}</td>
          </tr>`)}
      </table>`}events(){return d`<div class="story">
      <h3>Events</h3>
      <ol reversed>
        ${[...this.story].reverse().map(t=>d`<li><span class="time">${this.time(t.frame)}</span> ${t.text}</li>`)}
      </ol>
    </div>`}};h([S({attribute:!1})],v.prototype,"game",2),h([S({attribute:!1})],v.prototype,"workerSource",2),h([m()],v.prototype,"info",2),h([m()],v.prototype,"shown",2),h([m()],v.prototype,"story",2),h([m()],v.prototype,"problem",2),h([m()],v.prototype,"references",2),h([m()],v.prototype,"isScanning",2),h([m()],v.prototype,"pointing",2),h([M("canvas")],v.prototype,"canvas",2),h([m()],v.prototype,"isOver",2);customElements.define("chaic-play",v);function Xt(n,e){let t=n.slots[e-1]??[],i=[{kind:"instructions"}],s=o=>n.conditions[o]?.seat==="helper"?"partner":"helper";t.forEach((o,l)=>{i.push({kind:"trial",number:l,trial:o});let[a,c]=o,f=t[l+1]?.[0]!==a;if(!(a===0||!f))for(let u of n.after_condition)i.push({kind:"form",position:a,name:u,other:s(c)})});let r=t.at(-1)?.[1]??0;for(let o of n.at_end)i.push({kind:"form",position:0,name:o,other:s(r)});return[...i,{kind:"debrief"}]}function we(n,e){return e.some(t=>{switch(n.kind){case"instructions":return t.type==="instructed";case"trial":return t.type==="trial_end"&&t.trial===n.number;case"form":return t.type==="answers"&&t.position===n.position&&t.form===n.name;case"debrief":return!1}})}function Qt(n,e){let t=n.findIndex(i=>!we(i,e));return t<0?n.length-1:t}function rt(n){let e=n.filter(i=>i.type==="trial").at(-1);return e&&!n.some(i=>i.type==="trial_end"&&i.trial===e.trial)?e.trial:void 0}var _e=7,L=class extends y{constructor(){super(...arguments);this.other="helper";this.ratings={};this.isWarned=!1}createRenderRoot(){return this}missing(){return(this.form?.items??[]).filter(t=>this.ratings[t.id]===void 0)}nextInputs(){let[t]=this.missing();return t?[...this.querySelectorAll(`fieldset[data-item="${t.id}"] input`)]:[...this.querySelectorAll("button")]}submit(t){t.preventDefault();let i=this.missing();if(i.length>0&&!this.isWarned){this.isWarned=!0,this.querySelector(`fieldset[data-item="${i[0].id}"] input`)?.focus();return}let s=this.form.items.map(r=>[r.id,this.ratings[r.id]??null]);this.dispatchEvent(new CustomEvent("answered",{detail:Object.fromEntries(s)}))}render(){let{form:t}=this;if(!t)return d``;let i=this.missing().length,s=r=>r.replaceAll("{other}",this.other);return d`<form class="questions" @submit=${r=>this.submit(r)}>
      <p>${s(t.instruction)}</p>
      ${t.items.map(r=>this.item(t,r,s(r.text)))}
      ${this.isWarned&&i>0?d`<p role="alert">${i===1?"One question has":`${i} questions have`} no answer. You may leave them out: select Continue again.</p>`:p}
      <p><button>Continue</button></p>
    </form>`}item(t,i,s){let r=Math.floor((t.last-t.first)/t.step)+1,o=Array.from({length:r},(c,f)=>t.first+f*t.step),l=c=>{this.ratings={...this.ratings,[i.id]:c}},a=c=>c===t.first?`${c}, ${i.low}`:c===t.last?`${c}, ${i.high}`:String(c);return d`<fieldset data-item=${i.id}>
      <legend>${s}</legend>
      <p class="small" aria-hidden="true">${t.first}: ${i.low}, ${t.last}: ${i.high}</p>
      <div class="ratings" style="--n: ${r}; --narrow: ${Math.min(r,_e)}">
        ${o.map(c=>d`<label class="rating">
            <input
              type="radio"
              name=${i.id}
              value=${c}
              aria-label=${a(c)}
              .checked=${this.ratings[i.id]===c}
              @change=${()=>l(c)}
            /><span aria-hidden="true">${c}</span>
          </label>`)}
      </div>
    </fieldset>`}};h([S({attribute:!1})],L.prototype,"form",2),h([S()],L.prototype,"other",2),h([m()],L.prototype,"ratings",2),h([m()],L.prototype,"isWarned",2);customElements.define("chaic-form",L);var q="records",F="identity";function nt(n){return new Promise((e,t)=>{n.onsuccess=()=>e(n.result),n.onerror=()=>t(n.error)})}var Se=3e3;function Zt(n){return navigator.locks?new Promise(e=>{let t=()=>(e(!0),new Promise(()=>{}));navigator.locks.request(n,{signal:AbortSignal.timeout(Se)},t).catch(()=>e(!1))}):Promise.resolve(!0)}var W=class n{constructor(e,t,i){this.name=e;this.database=t;this.records=i;this.nStored=i.length}static async open(e,t){let i=indexedDB.open(e,1),s=!1;i.onupgradeneeded=()=>{t?(i.result.createObjectStore(q,{autoIncrement:!0}),i.result.createObjectStore(F)):(s=!0,i.transaction.abort())};try{let r=await nt(i),o=await nt(r.transaction(q).objectStore(q).getAll());return new n(e,r,o)}catch(r){if(s)return;throw r}}async append(e){this.records.push(e),await this.change(q,t=>t.add(e)),this.nStored+=1}async readIdentity(){return this.database.objectStoreNames.contains(F)?await nt(this.database.transaction(F).objectStore(F).get(1)):void 0}setIdentity(e){return this.change(F,t=>t.put(e,1))}async clear(){this.records.length=0,this.nStored=0,await this.change(q,e=>e.clear())}change(e,t){return new Promise((i,s)=>{let r=this.database.transaction(e,"readwrite",{durability:"strict"});r.oncomplete=()=>i(),r.onabort=r.onerror=()=>s(r.error),t(r.objectStore(e))})}async delete(){this.database.close(),await nt(indexedDB.deleteDatabase(this.name)),this.records.length=0}toText(){return this.records.map(e=>JSON.stringify(e)+`
`).join("")}};var Ae=[1e3,3e4],xe=2e5,Ee=2e4,Te=32;function te(){let n=crypto.getRandomValues(new Uint8Array(Te));return Array.from(n,e=>e.toString(16).padStart(2,"0")).join("")}var ke=({status:n})=>n===0||n===408||n===429||n>=500;function Re(n){let[e,t]=Ae;return new Promise(i=>{let s=()=>{clearTimeout(r),removeEventListener("online",s),i()},r=setTimeout(s,Math.min(e*2**n,t));addEventListener("online",s)})}var O=class{constructor(e){this.identity=e;this.aborted=new AbortController}abort(){this.aborted.abort()}async enter(){let{status:e,start:t,stored:i,error:s}=await this.repeated("PUT","");if(e===0)return"aborted";if(t&&i!==void 0)return{start:t,stored:i};if(e===410)return"full";if(e===401)return"taken";throw new Error(s??`the server answers ${e}`)}async delete(){let{status:e,error:t}=await this.repeated("DELETE","");if(e!==200&&e!==404)throw new Error(t??`the server answers ${e}`)}async data(){let{bytes:e,error:t}=await this.request("GET","/data");if(t!==void 0)throw new Error(t);return e}async repeated(e,t,i,s){for(let r=0;;r++){let o=await this.request(e,t,i);if(this.aborted.signal.aborted||!ke(o))return o;s?.(),await Re(r)}}async request(e,t,i){let{code:s,token:r}=this.identity;try{let o=await fetch(`participants/${s}${t}`,{method:e,body:i,headers:{Authorization:`Bearer ${r}`},cache:"no-store",keepalive:(i?.length??0)<Ee,signal:AbortSignal.any([this.aborted.signal,AbortSignal.timeout(3e4)])});return o.headers.get("Content-Type")==="application/octet-stream"?{status:o.status,bytes:new Uint8Array(await o.arrayBuffer())}:{...await o.json(),status:o.status}}catch{return{status:0}}}},ot=class{constructor(e,t,i,s,r){this.participant=e;this.log=t;this.stored=i;this.isServerWriting=s;this.onChange=r;this.state="sending";this.problem="";this.isRunning=!1;this.waiters=[]}stop(){this.participant.abort()}async send(){if(!(this.isRunning||this.state==="refused")){for(this.isRunning=!0;this.stored===void 0||this.stored<this.log.nStored;){let e=this.stored;this.state==="saved"&&this.set("sending");let t=e===void 0?await this.participant.repeated("GET","",void 0,()=>this.set("waiting")):await this.participant.repeated("PUT",`/records/${e}`,this.batch(e),()=>this.set("waiting"));if(t.status===0)return;let i=this.log.records.length+(this.isServerWriting?1:0);if(t.stored===void 0||t.stored>i){this.problem=t.error??"the server has more data than this browser",this.set("refused");return}this.stored=t.stored}this.isRunning=!1,this.set("saved");for(let e of this.waiters.splice(0))e()}}async sent(){let e=new Promise(t=>this.waiters.push(t));await this.send(),await e}set(e){e!==this.state&&(this.state=e,this.onChange())}batch(e){let t="";for(let i of this.log.records.slice(e,this.log.nStored)){let s=JSON.stringify(i)+`
`;if(t!==""&&t.length+s.length>xe)break;t+=s}return t}};async function Pe(n){let e=await createImageBitmap(new Blob([n],{type:"image/png"})),{width:t,height:i}=e,s=new OffscreenCanvas(t,i).getContext("2d");s.drawImage(e,0,0),e.close();let r=s.getImageData(0,0,t,i).data;return{width:t,height:i,rgba:r}}var at=class{constructor(e,t,i,s){this.participant=e;this.trial=t;this.receive=i;this.onConnection=s;this.next=0;this.last=Promise.resolve();this.isClosed=!1;this.lastTime=0}post(e){this.last=this.last.then(()=>this.answer(e)).catch(t=>this.send({type:"error",message:String(t)}))}close(){this.isClosed=!0}send(e){this.isClosed||this.receive(e)}async request(e,t){let i=!1,s=o=>{o!==i&&this.onConnection(i=o)},r=await this.participant.repeated("PUT",`/trials/${this.trial}${e}`,t,()=>s(!0));return s(!1),r}async answer(e){this.isClosed||(e.type==="play"?await this.open():e.type==="trace"?this.send({type:"trace",trace:""}):e.type==="advance"&&await this.advance(e))}async open(){let e=await this.request("");if(!e.info)return this.refused(e);this.next=e.next??0,this.send({type:"playing",info:e.info})}refused({status:e,error:t}){e!==0&&(e===410?this.send({type:"over"}):this.send({type:"error",message:t??`the server answers ${e}`}))}async advance(e){let t=this.lastTime+70-performance.now();t>0&&await new Promise(c=>setTimeout(c,t)),this.lastTime=performance.now();let{frames:i,viewPx:s,input:r}=e,o=await this.request(`/turns/${this.next}`,JSON.stringify({frames:i,view_px:s,input:r}));if(o.status===409){let c=await this.request("");if(!c.info)return this.refused(c);this.next=c.next??0,o=await this.request(`/turns/${this.next}`,JSON.stringify({frames:0,view_px:s}))}if(!o.bytes)return this.refused(o);this.next+=1;let l=o.bytes.indexOf(10),a=JSON.parse(new TextDecoder().decode(o.bytes.subarray(0,l)));this.send({type:"live",state:a,view:await Pe(o.bytes.slice(l+1))})}};function ee(n){let[e=""]=n,t=/^(#{1,2}) (.*)$/.exec(e);if(t){let i=n.length>1?ee(n.slice(1)):d``;return t[1]==="#"?d`<h2>${t[2]}</h2>${i}`:d`<h3>${t[2]}</h3>${i}`}return n.every(i=>i.startsWith("- "))?d`<ul>${n.map(i=>d`<li>${i.slice(2)}</li>`)}</ul>`:d`<p>${n.join(" ")}</p>`}function lt(n){return n.split(/\r?\n[ \t]*\r?\n/).map(t=>t.split(/\r?\n/).map(i=>i.trim())).map(t=>t.filter(i=>i!=="")).filter(t=>t.length>0).map(ee)}var ie="ABCDEFGHJKLMNPQRSTUVWXYZ23456789",Le=10;function se(){let n=crypto.getRandomValues(new Uint8Array(Le));return Array.from(n,e=>ie[e%ie.length]).join("")}var g=class extends y{constructor(){super(...arguments);this.isLoading=!0;this.steps=[];this.at=0;this.playing="before";this.isResumed=!1;this.isScanning=!1;this.hasLeft=!1;this.isChanging=!1;this.isConnectionLost=!1;this.scanner=new st(()=>this.choices())}createRenderRoot(){return this}connectedCallback(){super.connectedCallback(),addEventListener("hashchange",()=>location.reload()),addEventListener("unhandledrejection",t=>this.fail(t.reason)),this.load().catch(t=>this.fail(t))}fail(t){this.problem=t instanceof Error?t.message:String(t)}async load(){let t=await bt(document.getElementById("chaic-study")),i=JSON.parse(new TextDecoder().decode(t));if(this.content=i,!i.server&&!this.takeSlot(Number(/^#(\d{1,5})$/.exec(location.hash)?.[1]))){this.isLoading=!1;return}if(!await Zt(this.logName())){this.problem="it is open in another tab. Go on there, or close that tab and load this page again.";return}let s=await W.open(this.logName(),!1),r=await s?.readIdentity();s&&r?await this.resumeWithServer(s,r):s?.records.length&&await this.resume(s),this.isLoading=!1}takeSlot(t){return this.content?.slots[t-1]?(this.slotNumber=t,this.steps=Xt(this.content,t),!0):!1}logName(){let{digest:t,server:i}=this.content;return`chaic-study-${t}-${i?"server":this.slotNumber}`}async resumeWithServer(t,i){let[s]=t.records;i.isLeaving?(this.hasLeft=!0,this.deleteEverywhere(t,i)):s?.type!=="start"?this.enter(t,i):(this.takeSlot(s.slot),this.startUpload(t,new O(i),void 0),await this.resume(t))}startUpload(t,i,s){let r=()=>{this.upload?.state==="refused"&&this.fail(`${this.upload.problem}. Your data are kept in this browser.`),this.requestUpdate()};this.participant=i,this.upload=new ot(i,t,s,this.isSimulatedByServer(),r),this.upload.send()}isSimulatedByServer(){return this.content?.play.simulator==="server"}async store(t){await this.log?.append(t),this.upload?.send()}async resume(t){this.log=t,this.isResumed=!0;let i=rt(t.records);i!==void 0&&!this.isSimulatedByServer()&&await this.store({type:"trial_end",trial:i,outcome:"left"}),this.at=Qt(this.steps,t.records)}async once(t){if(!this.isChanging){this.isChanging=!0;try{await t()}finally{this.isChanging=!1}}}async agree(){let{format:t,version:i,chaic:s,digest:r,server:o}=this.content;o&&(this.waits="entry");let l=await W.open(this.logName(),!0);if(!l)return;if(o){await this.enter(l);return}let a={format:t,version:i,chaic:s,study:r,code:se(),slot:this.slotNumber};await l.append({type:"start",...a}),this.log=l,this.focusHeading()}async enter(t,i){let s=i??{code:se(),token:te(),isLeaving:!1};i||await t.setIdentity(s);let r=new O(s);this.entering={log:t,participant:r},this.waits="entry";let o=await r.enter();o!=="aborted"&&(this.entering=void 0,o==="taken"?await this.enter(t):o==="full"?(await t.delete(),this.waits="full",this.focusHeading()):o.start.type==="start"&&this.takeSlot(o.start.slot)&&(await t.append(o.start),this.waits=void 0,this.log=t,this.startUpload(t,r,o.stored),this.focusHeading()))}async advance(t){t&&await this.store(t),this.at+=1,this.playing="before",this.game=void 0,this.isResumed=!1;let i=this.steps[this.at]?.kind==="debrief",s=this.log?.records.some(r=>r.type==="complete");i&&!s&&await this.store({type:"complete"}),this.focusHeading()}async leave(){this.dialog?.close(),this.playing="before",this.game=void 0;let{entering:t,upload:i}=this,s=this.log??t?.log;this.log=void 0,this.entering=void 0,this.hasLeft=!0,t?.participant.abort(),i?.stop();let r=await s?.readIdentity();this.focusHeading(),s&&r?await this.deleteEverywhere(s,r):await s?.delete()}async deleteEverywhere(t,i){this.waits="deletion",await t.setIdentity({...i,isLeaving:!0}),await t.clear(),await new O(i).delete(),await t.delete(),this.waits=void 0}async removeCopy(){let{log:t}=this;this.upload?.stop(),this.log=void 0,this.waits="removed",await t?.delete(),this.focusHeading()}focusHeading(){this.updateComplete.then(()=>{this.querySelector("h1")?.focus(),scrollTo(0,0)})}code(){let[t]=this.log?.records??[];return t?.type==="start"?t.code:""}async startTrial(t){let{content:i,log:s}=this;if(!i||!s)return;let r=this.isSimulatedByServer();r||(this.module??=await jt());let[,o,l,a]=t.trial,{seat:c,input:f}=i.conditions[o];rt(s.records)===t.number||await this.store({type:"trial",trial:t.number}),this.game={module:this.module??new ArrayBuffer(0),episode:new TextEncoder().encode(i.episodes[l??-1]??""),config:{seed:i.seed,seat:c==="partner"?0:1,level:f,helper:a??"none"},isLive:i.play.world==="goes_on",speed:i.play.speed,isStudy:!0,startSimulator:r?b=>this.startSimulator(t.number,b):void 0},this.playing="running"}startSimulator(t,i){let s=l=>{this.isConnectionLost=l},r=new at(this.participant,t,i,s),o=this.upload.sent();return{post:l=>{o.then(()=>r.post(l))},close:()=>r.close()}}endTrial(t,i){this.endedTrial!==t&&(this.endedTrial=t,this.store({type:"trial_end",trial:t,outcome:i}).then(()=>{this.playing="over",this.updateComplete.then(()=>this.querySelector("#continue")?.focus())}))}async download(){let t=this.isSimulatedByServer()?await this.participant?.data():this.log?.toText();if(t===void 0)return;let i=document.createElement("a");i.href=URL.createObjectURL(new Blob([t],{type:"application/jsonl"})),i.download=`${this.code()}.jsonl`,i.click(),URL.revokeObjectURL(i.href)}choices(){let t=(o,l)=>[...o.querySelectorAll(l)].filter(a=>a.checkVisibility());if(this.dialog?.open)return t(this.dialog,"button");let i=t(this,"#leave");if(this.form)return[...this.form.nextInputs(),...i];let s=this.playing==="running"?this.player?.shadowRoot:void 0;return[...s?t(s,".plans button, .controls button, button.link"):[],...t(this,".step > p > button"),...i]}press(t){let i=t.target;t.key!=="Enter"||!i.matches("input[type=radio], input[type=checkbox]")||(t.preventDefault(),i.click())}render(){let t=this.log?`Part ${this.at+1} of ${this.steps.length}`:"";return d`<div class="study" @keydown=${i=>this.press(i)}>
      ${this.bar()}
      <section class="step">
        ${this.problem?d`<p class="problem" role="alert">The study cannot go on: ${this.problem}</p>`:p}
        <p class="small" role="status">${t}</p>
        <p class="small" role="status">${this.connection()}</p>
        ${this.current()}
      </section>
      ${this.question()}
    </div>`}connection(){let t=this.playing==="running"&&this.isSimulatedByServer();return this.hasLeft||!(this.upload?.state==="waiting"||t&&this.isConnectionLost)?"":t?"There is no connection to the server. The episode goes on when it is back.":"There is no connection to the server. Go on: your data are kept in this browser and sent later."}bar(){let t=i=>{this.isScanning=i.target.checked,this.scanner.set(this.isScanning)};return d`<div class="bar" role="group" aria-label="Study">
      <label title="Offers one choice after the other; Enter or space takes it">
        <input type="checkbox" .checked=${this.isScanning} @change=${t} />
        One switch
      </label>
      <button type="button" id="leave" ?disabled=${this.hasLeft} @click=${()=>this.dialog?.showModal()}>
        Stop and delete
      </button>
    </div>`}question(){return d`<dialog aria-labelledby="leave-title">
      <h2 id="leave-title">Stop and delete?</h2>
      <p>The study ends, and all your data ${this.places()} are deleted.</p>
      <p>
        <button type="button" @click=${()=>{this.leave()}}>Delete and stop</button>
        <button type="button" @click=${()=>this.dialog?.close()}>Go on with the study</button>
      </p>
    </dialog>`}places(){return this.content?.server?"in this browser and on the server":"in this browser"}current(){let{content:t}=this;if(!t||this.isLoading)return this.problem?d``:d`<p role="status">Loading ...</p>`;if(this.hasLeft)return d`${this.heading("You have stopped")}
        ${this.waits==="deletion"?d`<p>The server has not confirmed the deletion yet. Keep this page open, or open it again later.</p>`:d`<p>All your data ${this.places()} are deleted. You may close this page.</p>`}`;switch(this.waits){case"entry":return d`${this.heading(t.title)}
          <p role="status">The page asks the server for a place until it answers ...</p>`;case"full":return d`${this.heading("All places are taken")}
          <p>Thank you. Nothing is stored. You may close this page.</p>`;case"removed":return d`${this.heading("The end")}
          <p>The copy in this browser is removed. The next participant can load this page again.</p>`}if(this.slotNumber===void 0&&!t.server)return this.slotQuestion(t);if(!this.log)return this.consent(t);let i=this.steps[this.at];switch(i.kind){case"instructions":return this.instructions(t);case"trial":return this.trial(i);case"form":return this.questions(t,i);case"debrief":return this.debrief(t)}}heading(t){return d`<h1 tabindex="-1">${t}</h1>`}slotQuestion({title:t,slots:i}){let s=r=>{r.preventDefault();let o=new FormData(r.target).get("slot");location.hash=`#${Number(o)}`};return d`${this.heading(t)}
      <form @submit=${s}>
        <label>
          Your participant number, 1 to ${i.length}
          <input type="number" name="slot" min="1" max=${i.length} required />
        </label>
        <button>Continue</button>
      </form>`}consent({title:t,consent:i}){return d`${this.heading(t)} ${lt(i)}
      <p class="small">Nothing is stored before you agree.</p>
      <p>
        <button type="button" @click=${()=>{this.once(()=>this.agree())}}>I agree and take part</button>
        <button type="button" @click=${()=>{this.leave()}}>I do not take part</button>
      </p>`}instructions({instructions:t}){return d`${this.heading("Instructions")} ${lt(t)}
      <p>Your code is <b class="code">${this.code()}</b>. Keep it: with it, the researchers can delete your data later.</p>
      <p><button type="button" @click=${()=>{this.once(()=>this.advance({type:"instructed"}))}}>Continue</button></p>`}trial(t){let i=this.steps.filter(c=>c.kind==="trial"),s=t.trial[0]===0,r=rt(this.log?.records??[])===t.number,o=this.isSimulatedByServer()?"":"An episode that was interrupted is not repeated.",l=r?"The episode goes on where you were.":o,a=`Episode ${t.number+1} of ${i.length}${s?", practice":""}`;return this.playing==="before"?d`${this.heading(a)}
        ${this.isResumed?d`<p>The study goes on here. ${l}</p>`:p}
        <p>${s?"This episode is for practice.":"This episode counts."}</p>
        <p>
          <button type="button" @click=${()=>{this.once(()=>this.startTrial(t))}}>
            ${r?"Go on with the episode":"Start the episode"}
          </button>
        </p>`:d`${this.heading(a)}
      <chaic-play
        .workerSource=${this.isSimulatedByServer()?"":qt()}
        .game=${this.game}
        @recorded=${c=>{this.store({type:"trace",trial:t.number,text:c.detail})}}
        @over=${c=>this.endTrial(t.number,c.detail)}
      ></chaic-play>
      ${this.playing==="over"?d`<p>The episode is over. <button type="button" id="continue" @click=${()=>{this.once(()=>this.advance())}}>Continue</button></p>`:p}`}questions(t,i){let s=t.forms[i.name],r=o=>{let{position:l,name:a}=i;this.once(()=>this.advance({type:"answers",position:l,form:a,ratings:o.detail}))};return d`${this.heading(s.title)}
      ${Bt(`${i.position} ${i.name}`,d`<chaic-form .form=${s} .other=${i.other} @answered=${r}></chaic-form>`)}`}debrief(t){return d`${this.heading("The end")} ${lt(t.debrief)}
      <p>Completion code: <b class="code">${t.completion_code}</b></p>
      <p>Your code: <b class="code">${this.code()}</b>. With it, the researchers can delete your data.</p>
      <p>
        <button type="button" @click=${()=>{this.download()}}>Download your data</button>
      </p>
      <p class="small">The file has your answers and your decisions. It has no name, no address and no times of day.
        "Stop and delete" removes ${t.server?"all your data, also on the server":"the copy in this browser"}.</p>
      ${this.upload?this.uploaded(this.upload):p}`}uploaded({state:t}){return t!=="saved"?d`<p role="status">The server does not have all your data yet. Keep this page open, or open it again
        later. If that does not help, download your data and send them to the researchers.</p>`:d`<p role="status">The server has all your data. You may close this page.</p>
      <p><button type="button" @click=${()=>{this.removeCopy()}}>Remove the copy in this browser</button></p>`}};h([m()],g.prototype,"content",2),h([m()],g.prototype,"isLoading",2),h([m()],g.prototype,"slotNumber",2),h([m()],g.prototype,"log",2),h([m()],g.prototype,"steps",2),h([m()],g.prototype,"at",2),h([m()],g.prototype,"playing",2),h([m()],g.prototype,"isResumed",2),h([m()],g.prototype,"isScanning",2),h([m()],g.prototype,"hasLeft",2),h([m()],g.prototype,"problem",2),h([m()],g.prototype,"waits",2),h([M("dialog")],g.prototype,"dialog",2),h([M("chaic-play")],g.prototype,"player",2),h([M("chaic-form")],g.prototype,"form",2),h([m()],g.prototype,"isConnectionLost",2);customElements.define("chaic-study",g);})();
/*! Bundled license information:

@lit/reactive-element/css-tag.js:
  (**
   * @license
   * Copyright 2019 Google LLC
   * SPDX-License-Identifier: BSD-3-Clause
   *)

@lit/reactive-element/reactive-element.js:
lit-html/lit-html.js:
lit-element/lit-element.js:
@lit/reactive-element/decorators/custom-element.js:
@lit/reactive-element/decorators/property.js:
@lit/reactive-element/decorators/state.js:
@lit/reactive-element/decorators/event-options.js:
@lit/reactive-element/decorators/base.js:
@lit/reactive-element/decorators/query.js:
@lit/reactive-element/decorators/query-all.js:
@lit/reactive-element/decorators/query-async.js:
@lit/reactive-element/decorators/query-assigned-nodes.js:
lit-html/directive.js:
  (**
   * @license
   * Copyright 2017 Google LLC
   * SPDX-License-Identifier: BSD-3-Clause
   *)

lit-html/is-server.js:
  (**
   * @license
   * Copyright 2022 Google LLC
   * SPDX-License-Identifier: BSD-3-Clause
   *)

@lit/reactive-element/decorators/query-assigned-elements.js:
lit-html/directives/keyed.js:
  (**
   * @license
   * Copyright 2021 Google LLC
   * SPDX-License-Identifier: BSD-3-Clause
   *)

lit-html/directive-helpers.js:
  (**
   * @license
   * Copyright 2020 Google LLC
   * SPDX-License-Identifier: BSD-3-Clause
   *)
*/
