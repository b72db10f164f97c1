"use strict";(()=>{var Qt=Object.defineProperty;var Zt=Object.getOwnPropertyDescriptor;var d=(r,e,t,i)=>{for(var s=i>1?void 0:i?Zt(e,t):e,n=r.length-1,o;n>=0;n--)(o=r[n])&&(s=(i?o(e,t,s):o(s))||s);return i&&s&&Qt(e,t,s),s};var W=globalThis,z=W.ShadowRoot&&(W.ShadyCSS===void 0||W.ShadyCSS.nativeShadow)&&"adoptedStyleSheets"in Document.prototype&&"replace"in CSSStyleSheet.prototype,st=Symbol(),ft=new WeakMap,O=class{constructor(e,t,i){if(this._$cssResult$=!0,i!==st)throw Error("CSSResult is not constructable. Use `unsafeCSS` or `css` instead.");this.cssText=e,this.t=t}get styleSheet(){let e=this.o,t=this.t;if(z&&e===void 0){let i=t!==void 0&&t.length===1;i&&(e=ft.get(t)),e===void 0&&((this.o=e=new CSSStyleSheet).replaceSync(this.cssText),i&&ft.set(t,e))}return e}toString(){return this.cssText}},gt=r=>new O(typeof r=="string"?r:r+"",void 0,st),rt=(r,...e)=>{let t=r.length===1?r[0]:e.reduce((i,s,n)=>i+(o=>{if(o._$cssResult$===!0)return o.cssText;if(typeof o=="number")return o;throw Error("Value passed to 'css' function must be a 'css' function result: "+o+". Use 'unsafeCSS' to pass non-literal values, but take care to ensure page security.")})(s)+r[n+1],r[0]);return new O(t,r,st)},vt=(r,e)=>{if(z)r.adoptedStyleSheets=e.map(t=>t instanceof CSSStyleSheet?t:t.styleSheet);else for(let t of e){let i=document.createElement("style"),s=W.litNonce;s!==void 0&&i.setAttribute("nonce",s),i.textContent=t.cssText,r.appendChild(i)}},nt=z?r=>r:r=>r instanceof CSSStyleSheet?(e=>{let t="";for(let i of e.cssRules)t+=i.cssText;return gt(t)})(r):r;var{is:te,defineProperty:ee,getOwnPropertyDescriptor:ie,getOwnPropertyNames:se,getOwnPropertySymbols:re,getPrototypeOf:ne}=Object,V=globalThis,bt=V.trustedTypes,oe=bt?bt.emptyScript:"",ae=V.reactiveElementPolyfillSupport,H=(r,e)=>r,N={toAttribute(r,e){switch(e){case Boolean:r=r?oe:null;break;case Object:case Array:r=r==null?r:JSON.stringify(r)}return r},fromAttribute(r,e){let t=r;switch(e){case Boolean:t=r!==null;break;case Number:t=r===null?null:Number(r);break;case Object:case Array:try{t=JSON.parse(r)}catch{t=null}}return t}},K=(r,e)=>!te(r,e),$t={attribute:!0,type:String,converter:N,reflect:!1,useDefault:!1,hasChanged:K};Symbol.metadata??=Symbol("metadata"),V.litPropertyMetadata??=new WeakMap;var y=class extends HTMLElement{static addInitializer(e){this._$Ei(),(this.l??=[]).push(e)}static get observedAttributes(){return this.finalize(),this._$Eh&&[...this._$Eh.keys()]}static createProperty(e,t=$t){if(t.state&&(t.attribute=!1),this._$Ei(),this.prototype.hasOwnProperty(e)&&((t=Object.create(t)).wrapped=!0),this.elementProperties.set(e,t),!t.noAccessor){let i=Symbol(),s=this.getPropertyDescriptor(e,i,t);s!==void 0&&ee(this.prototype,e,s)}}static getPropertyDescriptor(e,t,i){let{get:s,set:n}=ie(this.prototype,e)??{get(){return this[t]},set(o){this[t]=o}};return{get:s,set(o){let l=s?.call(this);n?.call(this,o),this.requestUpdate(e,l,i)},configurable:!0,enumerable:!0}}static getPropertyOptions(e){return this.elementProperties.get(e)??$t}static _$Ei(){if(this.hasOwnProperty(H("elementProperties")))return;let e=ne(this);e.finalize(),e.l!==void 0&&(this.l=[...e.l]),this.elementProperties=new Map(e.elementProperties)}static finalize(){if(this.hasOwnProperty(H("finalized")))return;if(this.finalized=!0,this._$Ei(),this.hasOwnProperty(H("properties"))){let t=this.properties,i=[...se(t),...re(t)];for(let s of i)this.createProperty(s,t[s])}let e=this[Symbol.metadata];if(e!==null){let t=litPropertyMetadata.get(e);if(t!==void 0)for(let[i,s]of t)this.elementProperties.set(i,s)}this._$Eh=new Map;for(let[t,i]of this.elementProperties){let s=this._$Eu(t,i);s!==void 0&&this._$Eh.set(s,t)}this.elementStyles=this.finalizeStyles(this.styles)}static finalizeStyles(e){let t=[];if(Array.isArray(e)){let i=new Set(e.flat(1/0).reverse());for(let s of i)t.unshift(nt(s))}else e!==void 0&&t.push(nt(e));return t}static _$Eu(e,t){let i=t.attribute;return i===!1?void 0:typeof i=="string"?i:typeof e=="string"?e.toLowerCase():void 0}constructor(){super(),this._$Ep=void 0,this.isUpdatePending=!1,this.hasUpdated=!1,this._$Em=null,this._$Ev()}_$Ev(){this._$ES=new Promise(e=>this.enableUpdating=e),this._$AL=new Map,this._$E_(),this.requestUpdate(),this.constructor.l?.forEach(e=>e(this))}addController(e){(this._$EO??=new Set).add(e),this.renderRoot!==void 0&&this.isConnected&&e.hostConnected?.()}removeController(e){this._$EO?.delete(e)}_$E_(){let e=new Map,t=this.constructor.elementProperties;for(let i of t.keys())this.hasOwnProperty(i)&&(e.set(i,this[i]),delete this[i]);e.size>0&&(this._$Ep=e)}createRenderRoot(){let e=this.shadowRoot??this.attachShadow(this.constructor.shadowRootOptions);return vt(e,this.constructor.elementStyles),e}connectedCallback(){this.renderRoot??=this.createRenderRoot(),this.enableUpdating(!0),this._$EO?.forEach(e=>e.hostConnected?.())}enableUpdating(e){}disconnectedCallback(){this._$EO?.forEach(e=>e.hostDisconnected?.())}attributeChangedCallback(e,t,i){this._$AK(e,i)}_$ET(e,t){let i=this.constructor.elementProperties.get(e),s=this.constructor._$Eu(e,i);if(s!==void 0&&i.reflect===!0){let n=(i.converter?.toAttribute!==void 0?i.converter:N).toAttribute(t,i.type);this._$Em=e,n==null?this.removeAttribute(s):this.setAttribute(s,n),this._$Em=null}}_$AK(e,t){let i=this.constructor,s=i._$Eh.get(e);if(s!==void 0&&this._$Em!==s){let n=i.getPropertyOptions(s),o=typeof n.converter=="function"?{fromAttribute:n.converter}:n.converter?.fromAttribute!==void 0?n.converter:N;this._$Em=s;let l=o.fromAttribute(t,n.type);this[s]=l??this._$Ej?.get(s)??l,this._$Em=null}}requestUpdate(e,t,i,s=!1,n){if(e!==void 0){let o=this.constructor;if(s===!1&&(n=this[e]),i??=o.getPropertyOptions(e),!((i.hasChanged??K)(n,t)||i.useDefault&&i.reflect&&n===this._$Ej?.get(e)&&!this.hasAttribute(o._$Eu(e,i))))return;this.C(e,t,i)}this.isUpdatePending===!1&&(this._$ES=this._$EP())}C(e,t,{useDefault:i,reflect:s,wrapped:n},o){i&&!(this._$Ej??=new Map).has(e)&&(this._$Ej.set(e,o??t??this[e]),n!==!0||o!==void 0)||(this._$AL.has(e)||(this.hasUpdated||i||(t=void 0),this._$AL.set(e,t)),s===!0&&this._$Em!==e&&(this._$Eq??=new Set).add(e))}async _$EP(){this.isUpdatePending=!0;try{await this._$ES}catch(t){Promise.reject(t)}let e=this.scheduleUpdate();return e!=null&&await e,!this.isUpdatePending}scheduleUpdate(){return this.performUpdate()}performUpdate(){if(!this.isUpdatePending)return;if(!this.hasUpdated){if(this.renderRoot??=this.createRenderRoot(),this._$Ep){for(let[s,n]of this._$Ep)this[s]=n;this._$Ep=void 0}let i=this.constructor.elementProperties;if(i.size>0)for(let[s,n]of i){let{wrapped:o}=n,l=this[s];o!==!0||this._$AL.has(s)||l===void 0||this.C(s,void 0,n,l)}}let e=!1,t=this._$AL;try{e=this.shouldUpdate(t),e?(this.willUpdate(t),this._$EO?.forEach(i=>i.hostUpdate?.()),this.update(t)):this._$EM()}catch(i){throw e=!1,this._$EM(),i}e&&this._$AE(t)}willUpdate(e){}_$AE(e){this._$EO?.forEach(t=>t.hostUpdated?.()),this.hasUpdated||(this.hasUpdated=!0,this.firstUpdated(e)),this.updated(e)}_$EM(){this._$AL=new Map,this.isUpdatePending=!1}get updateComplete(){return this.getUpdateComplete()}getUpdateComplete(){return this._$ES}shouldUpdate(e){return!0}update(e){this._$Eq&&=this._$Eq.forEach(t=>this._$ET(t,this[t])),this._$EM()}updated(e){}firstUpdated(e){}};y.elementStyles=[],y.shadowRootOptions={mode:"open"},y[H("elementProperties")]=new Map,y[H("finalized")]=new Map,ae?.({ReactiveElement:y}),(V.reactiveElementVersions??=[]).push("2.1.2");var at=globalThis,yt=r=>r,Y=at.trustedTypes,_t=Y?Y.createPolicy("lit-html",{createHTML:r=>r}):void 0,lt="$lit$",_=`lit$${Math.random().toFixed(9).slice(2)}$`,ct="?"+_,le=`<${ct}>`,S=document,D=()=>S.createComment(""),I=r=>r===null||typeof r!="object"&&typeof r!="function",ht=Array.isArray,kt=r=>ht(r)||typeof r?.[Symbol.iterator]=="function",ot=`[ 	
\f\r]`,U=/<(?:(!--|\/[^a-zA-Z])|(\/?[a-zA-Z][^>\s]*)|(\/?$))/g,wt=/-->/g,At=/>/g,E=RegExp(`>|${ot}(?:([^\\s"'>=/]+)(${ot}*=${ot}*(?:[^ 	
\f\r"'\`<>=]|("|')|))|$)`,"g"),Et=/'/g,xt=/"/g,Tt=/^(?:script|style|textarea|title)$/i,pt=r=>(e,...t)=>({_$litType$:r,strings:e,values:t}),c=pt(1),Se=pt(2),ke=pt(3),k=Symbol.for("lit-noChange"),p=Symbol.for("lit-nothing"),St=new WeakMap,x=S.createTreeWalker(S,129);function Rt(r,e){if(!ht(r)||!r.hasOwnProperty("raw"))throw Error("invalid template strings array");return _t!==void 0?_t.createHTML(e):e}var Ct=(r,e)=>{let t=r.length-1,i=[],s,n=e===2?"<svg>":e===3?"<math>":"",o=U;for(let l=0;l<t;l++){let a=r[l],h,f,u=-1,$=0;for(;$<a.length&&(o.lastIndex=$,f=o.exec(a),f!==null);)$=o.lastIndex,o===U?f[1]==="!--"?o=wt:f[1]!==void 0?o=At:f[2]!==void 0?(Tt.test(f[2])&&(s=RegExp("</"+f[2],"g")),o=E):f[3]!==void 0&&(o=E):o===E?f[0]===">"?(o=s??U,u=-1):f[1]===void 0?u=-2:(u=o.lastIndex-f[2].length,h=f[1],o=f[3]===void 0?E:f[3]==='"'?xt:Et):o===xt||o===Et?o=E:o===wt||o===At?o=U:(o=E,s=void 0);let w=o===E&&r[l+1].startsWith("/>")?" ":"";n+=o===U?a+le:u>=0?(i.push(h),a.slice(0,u)+lt+a.slice(u)+_+w):a+_+(u===-2?l:w)}return[Rt(r,n+(r[t]||"<?>")+(e===2?"</svg>":e===3?"</math>":"")),i]},B=class r{constructor({strings:e,_$litType$:t},i){let s;this.parts=[];let n=0,o=0,l=e.length-1,a=this.parts,[h,f]=Ct(e,t);if(this.el=r.createElement(h,i),x.currentNode=this.el.content,t===2||t===3){let u=this.el.content.firstChild;u.replaceWith(...u.childNodes)}for(;(s=x.nextNode())!==null&&a.length<l;){if(s.nodeType===1){if(s.hasAttributes())for(let u of s.getAttributeNames())if(u.endsWith(lt)){let $=f[o++],w=s.getAttribute(u).split(_),F=/([.?@])?(.*)/.exec($);a.push({type:1,index:n,name:F[2],strings:w,ctor:F[1]==="."?X:F[1]==="?"?J:F[1]==="@"?Q:R}),s.removeAttribute(u)}else u.startsWith(_)&&(a.push({type:6,index:n}),s.removeAttribute(u));if(Tt.test(s.tagName)){let u=s.textContent.split(_),$=u.length-1;if($>0){s.textContent=Y?Y.emptyScript:"";for(let w=0;w<$;w++)s.append(u[w],D()),x.nextNode(),a.push({type:2,index:++n});s.append(u[$],D())}}}else if(s.nodeType===8)if(s.data===ct)a.push({type:2,index:n});else{let u=-1;for(;(u=s.data.indexOf(_,u+1))!==-1;)a.push({type:7,index:n}),u+=_.length-1}n++}}static createElement(e,t){let i=S.createElement("template");return i.innerHTML=e,i}};function T(r,e,t=r,i){if(e===k)return e;let s=i!==void 0?t._$Co?.[i]:t._$Cl,n=I(e)?void 0:e._$litDirective$;return s?.constructor!==n&&(s?._$AO?.(!1),n===void 0?s=void 0:(s=new n(r),s._$AT(r,t,i)),i!==void 0?(t._$Co??=[])[i]=s:t._$Cl=s),s!==void 0&&(e=T(r,s._$AS(r,e.values),s,i)),e}var G=class{constructor(e,t){this._$AV=[],this._$AN=void 0,this._$AD=e,this._$AM=t}get parentNode(){return this._$AM.parentNode}get _$AU(){return this._$AM._$AU}u(e){let{el:{content:t},parts:i}=this._$AD,s=(e?.creationScope??S).importNode(t,!0);x.currentNode=s;let n=x.nextNode(),o=0,l=0,a=i[0];for(;a!==void 0;){if(o===a.index){let h;a.type===2?h=new M(n,n.nextSibling,this,e):a.type===1?h=new a.ctor(n,a.name,a.strings,this,e):a.type===6&&(h=new Z(n,this,e)),this._$AV.push(h),a=i[++l]}o!==a?.index&&(n=x.nextNode(),o++)}return x.currentNode=S,s}p(e){let t=0;for(let i of this._$AV)i!==void 0&&(i.strings!==void 0?(i._$AI(e,i,t),t+=i.strings.length-2):i._$AI(e[t])),t++}},M=class r{get _$AU(){return this._$AM?._$AU??this._$Cv}constructor(e,t,i,s){this.type=2,this._$AH=p,this._$AN=void 0,this._$AA=e,this._$AB=t,this._$AM=i,this.options=s,this._$Cv=s?.isConnected??!0}get parentNode(){let e=this._$AA.parentNode,t=this._$AM;return t!==void 0&&e?.nodeType===11&&(e=t.parentNode),e}get startNode(){return this._$AA}get endNode(){return this._$AB}_$AI(e,t=this){e=T(this,e,t),I(e)?e===p||e==null||e===""?(this._$AH!==p&&this._$AR(),this._$AH=p):e!==this._$AH&&e!==k&&this._(e):e._$litType$!==void 0?this.$(e):e.nodeType!==void 0?this.T(e):kt(e)?this.k(e):this._(e)}O(e){return this._$AA.parentNode.insertBefore(e,this._$AB)}T(e){this._$AH!==e&&(this._$AR(),this._$AH=this.O(e))}_(e){this._$AH!==p&&I(this._$AH)?this._$AA.nextSibling.data=e:this.T(S.createTextNode(e)),this._$AH=e}$(e){let{values:t,_$litType$:i}=e,s=typeof i=="number"?this._$AC(e):(i.el===void 0&&(i.el=B.createElement(Rt(i.h,i.h[0]),this.options)),i);if(this._$AH?._$AD===s)this._$AH.p(t);else{let n=new G(s,this),o=n.u(this.options);n.p(t),this.T(o),this._$AH=n}}_$AC(e){let t=St.get(e.strings);return t===void 0&&St.set(e.strings,t=new B(e)),t}k(e){ht(this._$AH)||(this._$AH=[],this._$AR());let t=this._$AH,i,s=0;for(let n of e)s===t.length?t.push(i=new r(this.O(D()),this.O(D()),this,this.options)):i=t[s],i._$AI(n),s++;s<t.length&&(this._$AR(i&&i._$AB.nextSibling,s),t.length=s)}_$AR(e=this._$AA.nextSibling,t){for(this._$AP?.(!1,!0,t);e!==this._$AB;){let i=yt(e).nextSibling;yt(e).remove(),e=i}}setConnected(e){this._$AM===void 0&&(this._$Cv=e,this._$AP?.(e))}},R=class{get tagName(){return this.element.tagName}get _$AU(){return this._$AM._$AU}constructor(e,t,i,s,n){this.type=1,this._$AH=p,this._$AN=void 0,this.element=e,this.name=t,this._$AM=s,this.options=n,i.length>2||i[0]!==""||i[1]!==""?(this._$AH=Array(i.length-1).fill(new String),this.strings=i):this._$AH=p}_$AI(e,t=this,i,s){let n=this.strings,o=!1;if(n===void 0)e=T(this,e,t,0),o=!I(e)||e!==this._$AH&&e!==k,o&&(this._$AH=e);else{let l=e,a,h;for(e=n[0],a=0;a<n.length-1;a++)h=T(this,l[i+a],t,a),h===k&&(h=this._$AH[a]),o||=!I(h)||h!==this._$AH[a],h===p?e=p:e!==p&&(e+=(h??"")+n[a+1]),this._$AH[a]=h}o&&!s&&this.j(e)}j(e){e===p?this.element.removeAttribute(this.name):this.element.setAttribute(this.name,e??"")}},X=class extends R{constructor(){super(...arguments),this.type=3}j(e){this.element[this.name]=e===p?void 0:e}},J=class extends R{constructor(){super(...arguments),this.type=4}j(e){this.element.toggleAttribute(this.name,!!e&&e!==p)}},Q=class extends R{constructor(e,t,i,s,n){super(e,t,i,s,n),this.type=5}_$AI(e,t=this){if((e=T(this,e,t,0)??p)===k)return;let i=this._$AH,s=e===p&&i!==p||e.capture!==i.capture||e.once!==i.once||e.passive!==i.passive,n=e!==p&&(i===p||s);s&&this.element.removeEventListener(this.name,this,i),n&&this.element.addEventListener(this.name,this,e),this._$AH=e}handleEvent(e){typeof this._$AH=="function"?this._$AH.call(this.options?.host??this.element,e):this._$AH.handleEvent(e)}},Z=class{constructor(e,t,i){this.element=e,this.type=6,this._$AN=void 0,this._$AM=t,this.options=i}get _$AU(){return this._$AM._$AU}_$AI(e){T(this,e)}},Lt={M:lt,P:_,A:ct,C:1,L:Ct,R:G,D:kt,V:T,I:M,H:R,N:J,U:Q,B:X,F:Z},ce=at.litHtmlPolyfillSupport;ce?.(B,M),(at.litHtmlVersions??=[]).push("3.3.3");var Mt=(r,e,t)=>{let i=t?.renderBefore??e,s=i._$litPart$;if(s===void 0){let n=t?.renderBefore??null;i._$litPart$=s=new M(e.insertBefore(D(),n),n,void 0,t??{})}return s._$AI(r),s};var dt=globalThis,b=class extends y{constructor(){super(...arguments),this.renderOptions={host:this},this._$Do=void 0}createRenderRoot(){let e=super.createRenderRoot();return this.renderOptions.renderBefore??=e.firstChild,e}update(e){let t=this.render();this.hasUpdated||(this.renderOptions.isConnected=this.isConnected),super.update(e),this._$Do=Mt(t,this.renderRoot,this.renderOptions)}connectedCallback(){super.connectedCallback(),this._$Do?.setConnected(!0)}disconnectedCallback(){super.disconnectedCallback(),this._$Do?.setConnected(!1)}render(){return k}};b._$litElement$=!0,b.finalized=!0,dt.litElementHydrateSupport?.({LitElement:b});var he=dt.litElementPolyfillSupport;he?.({LitElement:b});(dt.litElementVersions??=[]).push("4.2.2");var pe={attribute:!0,type:String,converter:N,reflect:!1,hasChanged:K},de=(r=pe,e,t)=>{let{kind:i,metadata:s}=t,n=globalThis.litPropertyMetadata.get(s);if(n===void 0&&globalThis.litPropertyMetadata.set(s,n=new Map),i==="setter"&&((r=Object.create(r)).wrapped=!0),n.set(t.name,r),i==="accessor"){let{name:o}=t;return{set(l){let a=e.get.call(this);e.set.call(this,l),this.requestUpdate(o,a,r,!0,l)},init(l){return l!==void 0&&this.C(o,void 0,r,l),l}}}if(i==="setter"){let{name:o}=t;return function(l){let a=this[o];e.call(this,l),this.requestUpdate(o,a,r,!0,l)}}throw Error("Unsupported decorator location: "+i)};function A(r){return(e,t)=>typeof t=="object"?de(r,e,t):((i,s,n)=>{let o=s.hasOwnProperty(n);return s.constructor.createProperty(n,i),o?Object.getOwnPropertyDescriptor(s,n):void 0})(r,e,t)}function m(r){return A({...r,state:!0,attribute:!1})}var C=(r,e,t)=>(t.configurable=!0,t.enumerable=!0,Reflect.decorate&&typeof e!="object"&&Object.defineProperty(r,e,t),t);function P(r,e){return(t,i,s)=>{let n=o=>o.renderRoot?.querySelector(r)??null;if(e){let{get:o,set:l}=typeof i=="object"?t:s??(()=>{let a=Symbol();return{get(){return this[a]},set(h){this[a]=h}}})();return C(t,i,{get(){let a=o.call(this);return a===void 0&&(a=n(this),(a!==null||this.hasUpdated)&&l.call(this,a)),a}})}return C(t,i,{get(){return n(this)}})}}var Pt=r=>(...e)=>({_$litDirective$:r,values:e}),tt=class{constructor(e){}get _$AU(){return this._$AM._$AU}_$AT(e,t,i){this._$Ct=e,this._$AM=t,this._$Ci=i}_$AS(e,t){return this.update(e,t)}update(e,t){return this.render(...t)}};var{I:fi}=Lt;var ue={},Ot=(r,e=ue)=>r._$AH=e;var Ht=Pt(class extends tt{constructor(){super(...arguments),this.key=p}render(r,e){return this.key=r,e}update(r,[e,t]){return e!==this.key&&(Ot(r),this.key=e),t}});async function ut(r){let e=Uint8Array.from(atob(r.textContent.trim()),i=>i.charCodeAt(0)),t=new Blob([e]).stream().pipeThrough(new DecompressionStream("deflate-raw"));return new Response(t).arrayBuffer()}var Nt=()=>ut(document.getElementById("chaic-module")),Ut=()=>document.getElementById("chaic-worker").textContent;function Dt(r,e){let t=Math.floor(r/e);return`${Math.floor(t/60)}:${String(t%60).padStart(2,"0")}`}var It={view:512,map:720};function Bt(r,e){let i=(r?.clientWidth??0)*devicePixelRatio;return Math.min(Math.max(64*Math.ceil(i/64),64),e)}function jt(r,{width:e,height:t,rgba:i}){let s=r?.getContext("2d");!r||!s||((r.width!==e||r.height!==t)&&(r.width=e,r.height=t),s.putImageData(new ImageData(i,e,t),0,0))}var et=class{constructor(e){this.choices=e;this.timer=0}set(e){clearInterval(this.timer),this.timer=e?window.setInterval(()=>this.next(),1500):0}next(){let e=this.choices(),t=document.activeElement;for(;t?.shadowRoot?.activeElement;)t=t.shadowRoot.activeElement;let i=e.findIndex(s=>s===t);e[(i+1)%e.length]?.focus()}};var qt=rt`
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
  .trails {
    left: 0;
    pointer-events: none;
    position: absolute;
    top: 0;
    width: 100%;
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
`;var Ft=512,Wt=["none","rhp","oracle"],fe=3,zt=15,v=class extends b{constructor(){super(...arguments);this.workerSource="";this.story=[];this.references=new Map;this.isScanning=!1;this.pointing={kind:"pick_up",hand:"left"};this.isBusy=!1;this.isOver=!1;this.lastTime=0;this.elapsedFrames=0;this.scanTimer=0;this.recordedLength=0;this.recordedFrame=0;this.nTraceRequests=0}static{this.styles=qt}disconnectedCallback(){super.disconnectedCallback(),this.close()}updated(t){t.has("game")&&this.game&&this.open(this.game)}close(){this.worker?.terminate(),this.worker=void 0,clearInterval(this.scanTimer),this.info=this.shown=this.problem=void 0,this.isScanning=!1,this.story=[],this.references=new Map,this.isOver=!1,this.recordedLength=this.recordedFrame=this.nTraceRequests=0}open(t){this.close();let i=URL.createObjectURL(new Blob([this.workerSource],{type:"text/javascript"}));this.worker=new Worker(i),URL.revokeObjectURL(i),this.worker.onmessage=a=>this.receive(a.data),this.worker.onerror=a=>this.fail(a.message||"the worker has stopped");let{module:s,episode:n,config:o,branch:l}=t;this.post({type:"play",module:s,episode:n,config:o,branch:l})}post(t){this.isBusy=!0,this.worker?.postMessage(t)}receive(t){switch(this.isBusy=!1,t.type){case"playing":this.info=t.info,this.updateComplete.then(()=>this.begin());break;case"live":this.show(t.state),jt(this.canvas,t.view);break;case"trace":this.nTraceRequests-=1,this.game?.isStudy&&this.record(t.trace),this.isOver&&this.nTraceRequests===0&&this.finish(t.trace);break;case"reference":this.references=new Map(this.references).set(t.helper,t.rate),this.compareNext();break;case"error":this.fail(t.message);break}}fail(t){this.problem=t,this.game?.isStudy&&this.dispatchEvent(new CustomEvent("over",{detail:"left"}))}begin(){this.lastTime=performance.now(),this.elapsedFrames=1,requestAnimationFrame(t=>this.advance(t))}advance(t){if(!this.worker||this.problem||this.isOver)return;let i=(this.game?.speed??1)*(this.info?.frames_per_second??0);this.elapsedFrames+=Math.min(t-this.lastTime,250)/1e3*i,this.lastTime=t;let s=this.shown?.status==="waiting"&&!this.input;s&&this.game?.isLive&&this.elapsedFrames>=1&&this.pause();let n=Math.floor(this.elapsedFrames);if(!this.isBusy&&n>0&&(!s||this.input)){this.elapsedFrames-=n;let o=Bt(this.canvas,It.view);this.post({type:"advance",frames:n,viewPx:o,input:this.input}),this.input&&(this.recordedFrame=-zt),this.input=void 0}else s&&(this.elapsedFrames=Math.min(this.elapsedFrames,1));requestAnimationFrame(o=>this.advance(o))}pause(){this.game?.config.level==="steps"&&(this.input={action:{wait:{frames:fe}}})}show(t){let i=t.status==="waiting"&&this.shown?.status!=="waiting";this.shown=t,t.events.length>0&&(this.story=[...this.story,...t.events]),t.status==="ended"?this.stop():this.game?.isStudy&&(i||t.frame-this.recordedFrame>=zt)&&(this.recordedFrame=t.frame,this.requestTrace()),i&&this.updateComplete.then(()=>this.focusChoices())}focusChoices(){let t=document.activeElement;t!==document.body&&t!==this||this.shadowRoot?.querySelector(".plans button")?.focus()}stop(){this.isOver||(this.isOver=!0,this.requestTrace())}requestTrace(){this.nTraceRequests+=1,this.post({type:"trace"})}record(t){let i=t.slice(this.recordedLength);this.recordedLength=t.length,i&&this.dispatchEvent(new CustomEvent("recorded",{detail:i}))}finish(t){let{episode:i,isStudy:s}=this.game;if(s){let n=this.shown?.status==="ended"?"ended":"stopped";this.dispatchEvent(new CustomEvent("over",{detail:n}));return}this.dispatchEvent(new CustomEvent("finished",{detail:{trace:t,episode:i}})),this.shown?.status==="ended"&&this.compareNext()}compareNext(){let t=Wt.find(i=>!this.references.has(i));t&&this.post({type:"reference",helper:t})}choose(t){this.shown?.status==="waiting"&&!this.isOver&&(this.input={plan:t})}act(t){this.shown?.status==="waiting"&&(this.input={action:t})}point(t){if(this.game?.config.level!=="steps")return;let i=t.currentTarget.getBoundingClientRect(),s=(h,f)=>Math.max(0,Math.min(Ft-1,Math.floor(h/f*Ft))),n={column:s(t.clientX-i.left,i.width),row:s(t.clientY-i.top,i.height)},{kind:o,hand:l}=this.pointing,a={pick_up:"object",put_on:"place",remove_obstacle:"obstacle"}[o];this.act({[o]:{[a]:{pixel:n},hand:l}})}press(t){let i=t.composedPath()[0];if(t.ctrlKey||t.altKey||t.metaKey||i.matches("select, input"))return;let s=this.game?.config.level==="steps",n=/^[1-9]$/.test(t.key)?Number(t.key)-1:void 0,l=s?{ArrowUp:"move_forward",ArrowLeft:"turn_left",ArrowRight:"turn_right",".":{wait:{frames:10}}}[t.key]:void 0;if(l)this.act(l);else if(!s&&n!==void 0)this.choose(n);else return;t.preventDefault()}scan(t){clearInterval(this.scanTimer),this.isScanning=t,t&&(this.scanTimer=window.setInterval(()=>this.focusNext(),1500))}focusNext(){let t=this.shadowRoot,i=[...t.querySelectorAll(".plans button")],s=i.findIndex(n=>n===t.activeElement);i[(s+1)%i.length]?.focus()}render(){let{info:t,shown:i}=this;return this.problem?c`<p class="problem" role="alert">Cannot play: ${this.problem}</p>`:t?c`<section aria-label="Play" @keydown=${s=>this.press(s)}>
      ${this.heading(t)}
      <div class="columns">
        <figure class="a${this.game?.config.seat??0}">
          <canvas
            class="view"
            width="512"
            height="512"
            role="img"
            aria-label="What you see"
            @pointerdown=${s=>this.point(s)}
          ></canvas>
        </figure>
        <div>
          ${i?this.status(i):p}
          ${this.game?.config.level==="plans"?this.plans(i):this.steps(i)}
          ${this.isOver?p:c`<p><button type="button" class="link" @click=${()=>this.stop()}>Stop here</button></p>`}
          ${i?.status==="ended"&&!this.game?.isStudy?this.result(i):p} ${this.events()}
        </div>
      </div>
    </section>`:c`<p role="status">Loading ...</p>`}heading(t){let i=this.game?.config.seat===1,[s,n]=t.reach_m.map(l=>l.toFixed(2)),o=i?"The partner wants something that you do not know. Find out and help.":`Your body: ${t.person}. You want ${t.goal.join(", ")}.`;return c`<header>
      <h2>${t.task}: you are the ${i?"helper":"partner"}</h2>
      <p>${o} You reach from ${s} to ${n} m and lift ${t.strength_kg.toFixed(0)} kg.</p>
      <p class="small">${t.episode}. A simulation: real people differ from these bodies and views.</p>
    </header>`}time(t){return Dt(t,this.info?.frames_per_second??1)}status(t){let{action:i,plan:s}=t.caption,n=t.hands.map(l=>l??"nothing"),o=t.progress?`, ${t.progress[0]} of ${t.progress[1]} delivered`:"";return c`<p class="time">
        ${this.time(t.frame)} of ${this.time(t.horizon)}${o}
      </p>
      <p>Left hand: ${n[0]}; right hand: ${n[1]}</p>
      <p role="status">You: ${i}${s?` (${s})`:""}${t.failure?`; failed: ${t.failure}`:""}</p>`}plans(t){return c`<h3>What next?</h3>
      <ol class="plans">
        ${(t?.plans??[]).map((i,s)=>c`<li><button type="button" @click=${()=>this.choose(s)}>${i}</button></li>`)}
      </ol>
      ${t?.status==="running"?c`<p>Doing it ...</p>`:p}
      ${this.game?.isStudy?p:this.scanChoice()}`}scanChoice(){return c`<label>
        <input
          type="checkbox"
          .checked=${this.isScanning}
          @change=${t=>this.scan(t.target.checked)}
        />
        Offer one plan after the other, for a single switch
      </label>`}steps(t){let i=(o,l)=>c`<button type="button" @click=${()=>this.act(l)}>${o}</button>`,s=o=>{let[l,a]=o.target.value.split(" ");this.pointing={kind:l,hand:a}},n=[["pick_up left","picks up with the left hand"],["pick_up right","picks up with the right hand"],["put_on left","puts what the left hand holds there"],["put_on right","puts what the right hand holds there"],["remove_obstacle left","removes an obstacle"]];return c`<div class="controls" role="group" aria-label="Actions">
        ${i("Turn left (left arrow)","turn_left")} ${i("Walk (up arrow)","move_forward")}
        ${i("Turn right (right arrow)","turn_right")} ${i("Put into the container","put_in")}
        ${i("Wait (.)",{wait:{frames:10}})}
      </div>
      <label>
        A click on the picture
        <select @change=${s}>
          ${n.map(([o,l])=>c`<option value=${o}>${l}</option>`)}
        </select>
      </label>
      ${t?.status==="running"?c`<p>Acting ...</p>`:p}`}result(t){let[i,s]=t.progress??[0,0],n=s>0?i/s:0,o=a=>a===void 0?"...":`${(100*a).toFixed(0)} %`,l=this.game?.config.seat===1?"your help":"you as the partner";return c`<h3>Result</h3>
      <table>
        <caption>Delivered part of the goal, same episode and seed</caption>
        <tr><th scope="row">${l}</th><td class="number">${o(n)}</td></tr>
        ${Wt.map(a=>c`<tr>
            <th scope="row">simulated partner, ${a==="none"?"no helper":`helper ${a}`}</th>
            <td class="number">${o(this.references.get(a))}</td>
          </tr>`)}
      </table>`}events(){return c`<div class="story">
      <h3>Events</h3>
      <ol reversed>
        ${[...this.story].reverse().map(t=>c`<li><span class="time">${this.time(t.frame)}</span> ${t.text}</li>`)}
      </ol>
    </div>`}};d([A({attribute:!1})],v.prototype,"game",2),d([A({attribute:!1})],v.prototype,"workerSource",2),d([m()],v.prototype,"info",2),d([m()],v.prototype,"shown",2),d([m()],v.prototype,"story",2),d([m()],v.prototype,"problem",2),d([m()],v.prototype,"references",2),d([m()],v.prototype,"isScanning",2),d([m()],v.prototype,"pointing",2),d([P("canvas")],v.prototype,"canvas",2),d([m()],v.prototype,"isOver",2);customElements.define("chaic-play",v);function Vt(r,e){let t=r.slots[e-1]??[],i=[{kind:"instructions"}],s=o=>r.conditions[o]?.seat==="helper"?"partner":"helper";t.forEach((o,l)=>{i.push({kind:"trial",number:l,trial:o});let[a,h]=o,f=t[l+1]?.[0]!==a;if(!(a===0||!f))for(let u of r.after_condition)i.push({kind:"form",position:a,name:u,other:s(h)})});let n=t.at(-1)?.[1]??0;for(let o of r.at_end)i.push({kind:"form",position:0,name:o,other:s(n)});return[...i,{kind:"debrief"}]}function ge(r,e){return e.some(t=>{switch(r.kind){case"instructions":return t.type==="instructed";case"trial":return t.type==="trial_end"&&t.trial===r.number;case"form":return t.type==="answers"&&t.position===r.position&&t.form===r.name;case"debrief":return!1}})}function Kt(r,e){let t=r.findIndex(i=>!ge(i,e));return t<0?r.length-1:t}function Yt(r){let e=r.filter(i=>i.type==="trial").at(-1);return e&&!r.some(i=>i.type==="trial_end"&&i.trial===e.trial)?e.trial:void 0}var ve=7,L=class extends b{constructor(){super(...arguments);this.other="helper";this.ratings={};this.isWarned=!1}createRenderRoot(){return this}missing(){return(this.form?.items??[]).filter(t=>this.ratings[t.id]===void 0)}nextInputs(){let[t]=this.missing();return t?[...this.querySelectorAll(`fieldset[data-item="${t.id}"] input`)]:[...this.querySelectorAll("button")]}submit(t){t.preventDefault();let i=this.missing();if(i.length>0&&!this.isWarned){this.isWarned=!0,this.querySelector(`fieldset[data-item="${i[0].id}"] input`)?.focus();return}let s=this.form.items.map(n=>[n.id,this.ratings[n.id]??null]);this.dispatchEvent(new CustomEvent("answered",{detail:Object.fromEntries(s)}))}render(){let{form:t}=this;if(!t)return c``;let i=this.missing().length,s=n=>n.replaceAll("{other}",this.other);return c`<form class="questions" @submit=${n=>this.submit(n)}>
      <p>${s(t.instruction)}</p>
      ${t.items.map(n=>this.item(t,n,s(n.text)))}
      ${this.isWarned&&i>0?c`<p role="alert">${i===1?"One question has":`${i} questions have`} no answer. You may leave them out: select Continue again.</p>`:p}
      <p><button>Continue</button></p>
    </form>`}item(t,i,s){let n=Math.floor((t.last-t.first)/t.step)+1,o=Array.from({length:n},(h,f)=>t.first+f*t.step),l=h=>{this.ratings={...this.ratings,[i.id]:h}},a=h=>h===t.first?`${h}, ${i.low}`:h===t.last?`${h}, ${i.high}`:String(h);return c`<fieldset data-item=${i.id}>
      <legend>${s}</legend>
      <p class="small" aria-hidden="true">${t.first}: ${i.low}, ${t.last}: ${i.high}</p>
      <div class="ratings" style="--n: ${n}; --narrow: ${Math.min(n,ve)}">
        ${o.map(h=>c`<label class="rating">
            <input
              type="radio"
              name=${i.id}
              value=${h}
              aria-label=${a(h)}
              .checked=${this.ratings[i.id]===h}
              @change=${()=>l(h)}
            /><span aria-hidden="true">${h}</span>
          </label>`)}
      </div>
    </fieldset>`}};d([A({attribute:!1})],L.prototype,"form",2),d([A()],L.prototype,"other",2),d([m()],L.prototype,"ratings",2),d([m()],L.prototype,"isWarned",2);customElements.define("chaic-form",L);var j="records";function mt(r){return new Promise((e,t)=>{r.onsuccess=()=>e(r.result),r.onerror=()=>t(r.error)})}var be=3e3;function Gt(r){return navigator.locks?new Promise(e=>{let t=()=>(e(!0),new Promise(()=>{}));navigator.locks.request(r,{signal:AbortSignal.timeout(be)},t).catch(()=>e(!1))}):Promise.resolve(!0)}var q=class r{constructor(e,t,i){this.name=e;this.database=t;this.records=i}static async open(e,t){let i=indexedDB.open(e,1),s=!1;i.onupgradeneeded=()=>{t?i.result.createObjectStore(j,{autoIncrement:!0}):(s=!0,i.transaction.abort())};try{let n=await mt(i),o=await mt(n.transaction(j).objectStore(j).getAll());return new r(e,n,o)}catch(n){if(s)return;throw n}}append(e){return this.records.push(e),new Promise((t,i)=>{let s=this.database.transaction(j,"readwrite");s.oncomplete=()=>t(),s.onabort=s.onerror=()=>i(s.error),s.objectStore(j).add(e)})}async delete(){this.database.close(),await mt(indexedDB.deleteDatabase(this.name)),this.records.length=0}toText(){return this.records.map(e=>JSON.stringify(e)+`
`).join("")}};function Xt(r){let[e=""]=r,t=/^(#{1,2}) (.*)$/.exec(e);if(t){let i=r.length>1?Xt(r.slice(1)):c``;return t[1]==="#"?c`<h2>${t[2]}</h2>${i}`:c`<h3>${t[2]}</h3>${i}`}return r.every(i=>i.startsWith("- "))?c`<ul>${r.map(i=>c`<li>${i.slice(2)}</li>`)}</ul>`:c`<p>${r.join(" ")}</p>`}function it(r){return r.split(/\r?\n[ \t]*\r?\n/).map(t=>t.split(/\r?\n/).map(i=>i.trim())).map(t=>t.filter(i=>i!=="")).filter(t=>t.length>0).map(Xt)}var Jt="ABCDEFGHJKLMNPQRSTUVWXYZ23456789",$e=10;function ye(){let r=crypto.getRandomValues(new Uint8Array($e));return Array.from(r,e=>Jt[e%Jt.length]).join("")}var g=class extends b{constructor(){super(...arguments);this.isLoading=!0;this.steps=[];this.at=0;this.playing="before";this.isResumed=!1;this.isScanning=!1;this.hasLeft=!1;this.scanner=new et(()=>this.choices())}createRenderRoot(){return this}connectedCallback(){super.connectedCallback(),addEventListener("hashchange",()=>location.reload()),addEventListener("unhandledrejection",t=>this.fail(t.reason)),this.load().catch(t=>this.fail(t))}fail(t){this.problem=t instanceof Error?t.message:String(t)}async load(){let t=await ut(document.getElementById("chaic-study")),i=JSON.parse(new TextDecoder().decode(t)),s=/^#(\d{1,5})$/.exec(location.hash)?.[1];if(this.content=i,s===void 0||!i.slots[Number(s)-1]){this.isLoading=!1;return}if(this.slotNumber=Number(s),this.steps=Vt(i,this.slotNumber),!await Gt(this.logName())){this.problem="it is open in another tab. Go on there, or close that tab and load this page again.";return}let n=await q.open(this.logName(),!1);n?.records.length&&await this.resume(n),this.isLoading=!1}logName(){return`chaic-study-${this.content.digest}-${this.slotNumber}`}async resume(t){this.log=t,this.isResumed=!0;let i=Yt(t.records);i!==void 0&&await t.append({type:"trial_end",trial:i,outcome:"left"}),this.at=Kt(this.steps,t.records)}async agree(){let{format:t,version:i,chaic:s,digest:n}=this.content,o=await q.open(this.logName(),!0);if(!o)return;let l={format:t,version:i,chaic:s,study:n,code:ye(),slot:this.slotNumber};await o.append({type:"start",...l}),this.log=o,this.focusHeading()}async advance(t){t&&await this.log?.append(t),this.at+=1,this.playing="before",this.game=void 0,this.isResumed=!1;let i=this.steps[this.at]?.kind==="debrief",s=this.log?.records.some(n=>n.type==="complete");i&&!s&&await this.log?.append({type:"complete"}),this.focusHeading()}async leave(){this.dialog?.close(),this.playing="before",this.game=void 0;let{log:t}=this;this.log=void 0,this.hasLeft=!0,await t?.delete(),this.focusHeading()}focusHeading(){this.updateComplete.then(()=>{this.querySelector("h1")?.focus(),scrollTo(0,0)})}code(){let[t]=this.log?.records??[];return t?.type==="start"?t.code:""}async startTrial(t){let{content:i,log:s}=this;if(!i||!s)return;this.module??=await Nt();let[,n,o,l]=t.trial,{seat:a,input:h}=i.conditions[n];await s.append({type:"trial",trial:t.number}),this.game={module:this.module,episode:new TextEncoder().encode(i.episodes[o]),config:{seed:i.seed,seat:a==="partner"?0:1,level:h,helper:l},isLive:i.play.world==="goes_on",speed:i.play.speed,isStudy:!0},this.playing="running"}endTrial(t,i){this.log?.append({type:"trial_end",trial:t,outcome:i}).then(()=>{this.playing="over",this.updateComplete.then(()=>this.querySelector("#continue")?.focus())})}download(){let t=document.createElement("a");t.href=URL.createObjectURL(new Blob([this.log?.toText()??""],{type:"application/jsonl"})),t.download=`${this.code()}.jsonl`,t.click(),URL.revokeObjectURL(t.href)}choices(){let t=(o,l)=>[...o.querySelectorAll(l)].filter(a=>a.checkVisibility());if(this.dialog?.open)return t(this.dialog,"button");let i=t(this,"#leave");if(this.form)return[...this.form.nextInputs(),...i];let s=this.playing==="running"?this.player?.shadowRoot:void 0;return[...s?t(s,".plans button, .controls button, button.link"):[],...t(this,".step > p > button"),...i]}press(t){let i=t.target;t.key!=="Enter"||!i.matches("input[type=radio], input[type=checkbox]")||(t.preventDefault(),i.click())}render(){let t=this.log?`Part ${this.at+1} of ${this.steps.length}`:"";return c`<div class="study" @keydown=${i=>this.press(i)}>
      ${this.bar()}
      <section class="step">
        ${this.problem?c`<p class="problem" role="alert">The study cannot go on: ${this.problem}</p>`:p}
        <p class="small" role="status">${t}</p>
        ${this.current()}
      </section>
      ${this.question()}
    </div>`}bar(){let t=i=>{this.isScanning=i.target.checked,this.scanner.set(this.isScanning)};return c`<div class="bar" role="group" aria-label="Study">
      <label title="Offers one choice after the other; Enter or space takes it">
        <input type="checkbox" .checked=${this.isScanning} @change=${t} />
        One switch
      </label>
      <button type="button" id="leave" ?disabled=${this.hasLeft} @click=${()=>this.dialog?.showModal()}>
        Stop and delete
      </button>
    </div>`}question(){return c`<dialog aria-labelledby="leave-title">
      <h2 id="leave-title">Stop and delete?</h2>
      <p>The study ends, and all your data in this browser are deleted.</p>
      <p>
        <button type="button" @click=${()=>{this.leave()}}>Delete and stop</button>
        <button type="button" @click=${()=>this.dialog?.close()}>Go on with the study</button>
      </p>
    </dialog>`}current(){let{content:t}=this;if(!t||this.isLoading)return this.problem?c``:c`<p role="status">Loading ...</p>`;if(this.hasLeft)return c`${this.heading("You have stopped")}
        <p>All your data in this browser are deleted. You may close this page.</p>`;if(this.slotNumber===void 0)return this.slotQuestion(t);if(!this.log)return this.consent(t);let i=this.steps[this.at];switch(i.kind){case"instructions":return this.instructions(t);case"trial":return this.trial(i);case"form":return this.questions(t,i);case"debrief":return this.debrief(t)}}heading(t){return c`<h1 tabindex="-1">${t}</h1>`}slotQuestion({title:t,slots:i}){let s=n=>{n.preventDefault();let o=new FormData(n.target).get("slot");location.hash=`#${Number(o)}`};return c`${this.heading(t)}
      <form @submit=${s}>
        <label>
          Your participant number, 1 to ${i.length}
          <input type="number" name="slot" min="1" max=${i.length} required />
        </label>
        <button>Continue</button>
      </form>`}consent({title:t,consent:i}){return c`${this.heading(t)} ${it(i)}
      <p class="small">Nothing is stored before you agree.</p>
      <p>
        <button type="button" @click=${()=>{this.agree()}}>I agree and take part</button>
        <button type="button" @click=${()=>{this.leave()}}>I do not take part</button>
      </p>`}instructions({instructions:t}){return c`${this.heading("Instructions")} ${it(t)}
      <p>Your code is <b class="code">${this.code()}</b>. Keep it: with it, the researchers can delete your data later.</p>
      <p><button type="button" @click=${()=>{this.advance({type:"instructed"})}}>Continue</button></p>`}trial(t){let i=this.steps.filter(o=>o.kind==="trial"),s=t.trial[0]===0,n=`Episode ${t.number+1} of ${i.length}${s?", practice":""}`;return this.playing==="before"?c`${this.heading(n)}
        ${this.isResumed?c`<p>The study goes on here. An episode that was interrupted is not repeated.</p>`:p}
        <p>${s?"This episode is for practice.":"This episode counts."}</p>
        <p><button type="button" @click=${()=>{this.startTrial(t)}}>Start the episode</button></p>`:c`${this.heading(n)}
      <chaic-play
        .workerSource=${Ut()}
        .game=${this.game}
        @recorded=${o=>{this.log?.append({type:"trace",trial:t.number,text:o.detail})}}
        @over=${o=>this.endTrial(t.number,o.detail)}
      ></chaic-play>
      ${this.playing==="over"?c`<p>The episode is over. <button type="button" id="continue" @click=${()=>{this.advance()}}>Continue</button></p>`:p}`}questions(t,i){let s=t.forms[i.name],n=o=>{let{position:l,name:a}=i;this.advance({type:"answers",position:l,form:a,ratings:o.detail})};return c`${this.heading(s.title)}
      ${Ht(`${i.position} ${i.name}`,c`<chaic-form .form=${s} .other=${i.other} @answered=${n}></chaic-form>`)}`}debrief({debrief:t,completion_code:i}){return c`${this.heading("The end")} ${it(t)}
      <p>Completion code: <b class="code">${i}</b></p>
      <p>Your code: <b class="code">${this.code()}</b>. With it, the researchers can delete your data.</p>
      <p>
        <button type="button" @click=${()=>this.download()}>Download your data</button>
      </p>
      <p class="small">The file has your answers and your decisions. It has no name, no address and no times of day.
        "Stop and delete" removes the copy in this browser.</p>`}};d([m()],g.prototype,"content",2),d([m()],g.prototype,"isLoading",2),d([m()],g.prototype,"slotNumber",2),d([m()],g.prototype,"log",2),d([m()],g.prototype,"steps",2),d([m()],g.prototype,"at",2),d([m()],g.prototype,"playing",2),d([m()],g.prototype,"isResumed",2),d([m()],g.prototype,"isScanning",2),d([m()],g.prototype,"hasLeft",2),d([m()],g.prototype,"problem",2),d([P("dialog")],g.prototype,"dialog",2),d([P("chaic-play")],g.prototype,"player",2),d([P("chaic-form")],g.prototype,"form",2);customElements.define("chaic-study",g);})();
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
