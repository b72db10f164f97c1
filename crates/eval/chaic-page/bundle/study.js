"use strict";(()=>{var se=Object.defineProperty;var re=Object.getOwnPropertyDescriptor;var p=(r,e,t,i)=>{for(var s=i>1?void 0:i?re(e,t):e,n=r.length-1,o;n>=0;n--)(o=r[n])&&(s=(i?o(e,t,s):o(s))||s);return i&&s&&se(e,t,s),s};var z=globalThis,V=z.ShadowRoot&&(z.ShadyCSS===void 0||z.ShadyCSS.nativeShadow)&&"adoptedStyleSheets"in Document.prototype&&"replace"in CSSStyleSheet.prototype,at=Symbol(),yt=new WeakMap,H=class{constructor(e,t,i){if(this._$cssResult$=!0,i!==at)throw Error("CSSResult is not constructable. Use `unsafeCSS` or `css` instead.");this.cssText=e,this.t=t}get styleSheet(){let e=this.o,t=this.t;if(V&&e===void 0){let i=t!==void 0&&t.length===1;i&&(e=yt.get(t)),e===void 0&&((this.o=e=new CSSStyleSheet).replaceSync(this.cssText),i&&yt.set(t,e))}return e}toString(){return this.cssText}},bt=r=>new H(typeof r=="string"?r:r+"",void 0,at),lt=(r,...e)=>{let t=r.length===1?r[0]:e.reduce((i,s,n)=>i+(o=>{if(o._$cssResult$===!0)return o.cssText;if(typeof o=="number")return o;throw Error("Value passed to 'css' function must be a 'css' function result: "+o+". Use 'unsafeCSS' to pass non-literal values, but take care to ensure page security.")})(s)+r[n+1],r[0]);return new H(t,r,at)},$t=(r,e)=>{if(V)r.adoptedStyleSheets=e.map(t=>t instanceof CSSStyleSheet?t:t.styleSheet);else for(let t of e){let i=document.createElement("style"),s=z.litNonce;s!==void 0&&i.setAttribute("nonce",s),i.textContent=t.cssText,r.appendChild(i)}},dt=V?r=>r:r=>r instanceof CSSStyleSheet?(e=>{let t="";for(let i of e.cssRules)t+=i.cssText;return bt(t)})(r):r;var{is:ne,defineProperty:oe,getOwnPropertyDescriptor:ae,getOwnPropertyNames:le,getOwnPropertySymbols:de,getPrototypeOf:he}=Object,K=globalThis,wt=K.trustedTypes,ce=wt?wt.emptyScript:"",pe=K.reactiveElementPolyfillSupport,I=(r,e)=>r,U={toAttribute(r,e){switch(e){case Boolean:r=r?ce:null;break;case Object:case Array:r=r==null?r:JSON.stringify(r)}return r},fromAttribute(r,e){let t=r;switch(e){case Boolean:t=r!==null;break;case Number:t=r===null?null:Number(r);break;case Object:case Array:try{t=JSON.parse(r)}catch{t=null}}return t}},G=(r,e)=>!ne(r,e),_t={attribute:!0,type:String,converter:U,reflect:!1,useDefault:!1,hasChanged:G};Symbol.metadata??=Symbol("metadata"),K.litPropertyMetadata??=new WeakMap;var $=class extends HTMLElement{static addInitializer(e){this._$Ei(),(this.l??=[]).push(e)}static get observedAttributes(){return this.finalize(),this._$Eh&&[...this._$Eh.keys()]}static createProperty(e,t=_t){if(t.state&&(t.attribute=!1),this._$Ei(),this.prototype.hasOwnProperty(e)&&((t=Object.create(t)).wrapped=!0),this.elementProperties.set(e,t),!t.noAccessor){let i=Symbol(),s=this.getPropertyDescriptor(e,i,t);s!==void 0&&oe(this.prototype,e,s)}}static getPropertyDescriptor(e,t,i){let{get:s,set:n}=ae(this.prototype,e)??{get(){return this[t]},set(o){this[t]=o}};return{get:s,set(o){let l=s?.call(this);n?.call(this,o),this.requestUpdate(e,l,i)},configurable:!0,enumerable:!0}}static getPropertyOptions(e){return this.elementProperties.get(e)??_t}static _$Ei(){if(this.hasOwnProperty(I("elementProperties")))return;let e=he(this);e.finalize(),e.l!==void 0&&(this.l=[...e.l]),this.elementProperties=new Map(e.elementProperties)}static finalize(){if(this.hasOwnProperty(I("finalized")))return;if(this.finalized=!0,this._$Ei(),this.hasOwnProperty(I("properties"))){let t=this.properties,i=[...le(t),...de(t)];for(let s of i)this.createProperty(s,t[s])}let e=this[Symbol.metadata];if(e!==null){let t=litPropertyMetadata.get(e);if(t!==void 0)for(let[i,s]of t)this.elementProperties.set(i,s)}this._$Eh=new Map;for(let[t,i]of this.elementProperties){let s=this._$Eu(t,i);s!==void 0&&this._$Eh.set(s,t)}this.elementStyles=this.finalizeStyles(this.styles)}static finalizeStyles(e){let t=[];if(Array.isArray(e)){let i=new Set(e.flat(1/0).reverse());for(let s of i)t.unshift(dt(s))}else e!==void 0&&t.push(dt(e));return t}static _$Eu(e,t){let i=t.attribute;return i===!1?void 0:typeof i=="string"?i:typeof e=="string"?e.toLowerCase():void 0}constructor(){super(),this._$Ep=void 0,this.isUpdatePending=!1,this.hasUpdated=!1,this._$Em=null,this._$Ev()}_$Ev(){this._$ES=new Promise(e=>this.enableUpdating=e),this._$AL=new Map,this._$E_(),this.requestUpdate(),this.constructor.l?.forEach(e=>e(this))}addController(e){(this._$EO??=new Set).add(e),this.renderRoot!==void 0&&this.isConnected&&e.hostConnected?.()}removeController(e){this._$EO?.delete(e)}_$E_(){let e=new Map,t=this.constructor.elementProperties;for(let i of t.keys())this.hasOwnProperty(i)&&(e.set(i,this[i]),delete this[i]);e.size>0&&(this._$Ep=e)}createRenderRoot(){let e=this.shadowRoot??this.attachShadow(this.constructor.shadowRootOptions);return $t(e,this.constructor.elementStyles),e}connectedCallback(){this.renderRoot??=this.createRenderRoot(),this.enableUpdating(!0),this._$EO?.forEach(e=>e.hostConnected?.())}enableUpdating(e){}disconnectedCallback(){this._$EO?.forEach(e=>e.hostDisconnected?.())}attributeChangedCallback(e,t,i){this._$AK(e,i)}_$ET(e,t){let i=this.constructor.elementProperties.get(e),s=this.constructor._$Eu(e,i);if(s!==void 0&&i.reflect===!0){let n=(i.converter?.toAttribute!==void 0?i.converter:U).toAttribute(t,i.type);this._$Em=e,n==null?this.removeAttribute(s):this.setAttribute(s,n),this._$Em=null}}_$AK(e,t){let i=this.constructor,s=i._$Eh.get(e);if(s!==void 0&&this._$Em!==s){let n=i.getPropertyOptions(s),o=typeof n.converter=="function"?{fromAttribute:n.converter}:n.converter?.fromAttribute!==void 0?n.converter:U;this._$Em=s;let l=o.fromAttribute(t,n.type);this[s]=l??this._$Ej?.get(s)??l,this._$Em=null}}requestUpdate(e,t,i,s=!1,n){if(e!==void 0){let o=this.constructor;if(s===!1&&(n=this[e]),i??=o.getPropertyOptions(e),!((i.hasChanged??G)(n,t)||i.useDefault&&i.reflect&&n===this._$Ej?.get(e)&&!this.hasAttribute(o._$Eu(e,i))))return;this.C(e,t,i)}this.isUpdatePending===!1&&(this._$ES=this._$EP())}C(e,t,{useDefault:i,reflect:s,wrapped:n},o){i&&!(this._$Ej??=new Map).has(e)&&(this._$Ej.set(e,o??t??this[e]),n!==!0||o!==void 0)||(this._$AL.has(e)||(this.hasUpdated||i||(t=void 0),this._$AL.set(e,t)),s===!0&&this._$Em!==e&&(this._$Eq??=new Set).add(e))}async _$EP(){this.isUpdatePending=!0;try{await this._$ES}catch(t){Promise.reject(t)}let e=this.scheduleUpdate();return e!=null&&await e,!this.isUpdatePending}scheduleUpdate(){return this.performUpdate()}performUpdate(){if(!this.isUpdatePending)return;if(!this.hasUpdated){if(this.renderRoot??=this.createRenderRoot(),this._$Ep){for(let[s,n]of this._$Ep)this[s]=n;this._$Ep=void 0}let i=this.constructor.elementProperties;if(i.size>0)for(let[s,n]of i){let{wrapped:o}=n,l=this[s];o!==!0||this._$AL.has(s)||l===void 0||this.C(s,void 0,n,l)}}let e=!1,t=this._$AL;try{e=this.shouldUpdate(t),e?(this.willUpdate(t),this._$EO?.forEach(i=>i.hostUpdate?.()),this.update(t)):this._$EM()}catch(i){throw e=!1,this._$EM(),i}e&&this._$AE(t)}willUpdate(e){}_$AE(e){this._$EO?.forEach(t=>t.hostUpdated?.()),this.hasUpdated||(this.hasUpdated=!0,this.firstUpdated(e)),this.updated(e)}_$EM(){this._$AL=new Map,this.isUpdatePending=!1}get updateComplete(){return this.getUpdateComplete()}getUpdateComplete(){return this._$ES}shouldUpdate(e){return!0}update(e){this._$Eq&&=this._$Eq.forEach(t=>this._$ET(t,this[t])),this._$EM()}updated(e){}firstUpdated(e){}};$.elementStyles=[],$.shadowRootOptions={mode:"open"},$[I("elementProperties")]=new Map,$[I("finalized")]=new Map,pe?.({ReactiveElement:$}),(K.reactiveElementVersions??=[]).push("2.1.2");var ct=globalThis,At=r=>r,X=ct.trustedTypes,Et=X?X.createPolicy("lit-html",{createHTML:r=>r}):void 0,pt="$lit$",w=`lit$${Math.random().toFixed(9).slice(2)}$`,ut="?"+w,ue=`<${ut}>`,x=document,D=()=>x.createComment(""),j=r=>r===null||typeof r!="object"&&typeof r!="function",mt=Array.isArray,Lt=r=>mt(r)||typeof r?.[Symbol.iterator]=="function",ht=`[ 	
\f\r]`,N=/<(?:(!--|\/[^a-zA-Z])|(\/?[a-zA-Z][^>\s]*)|(\/?$))/g,St=/-->/g,xt=/>/g,E=RegExp(`>|${ht}(?:([^\\s"'>=/]+)(${ht}*=${ht}*(?:[^ 	
\f\r"'\`<>=]|("|')|))|$)`,"g"),kt=/'/g,Tt=/"/g,Pt=/^(?:script|style|textarea|title)$/i,ft=r=>(e,...t)=>({_$litType$:r,strings:e,values:t}),d=ft(1),He=ft(2),Ie=ft(3),k=Symbol.for("lit-noChange"),c=Symbol.for("lit-nothing"),Rt=new WeakMap,S=x.createTreeWalker(x,129);function Ct(r,e){if(!mt(r)||!r.hasOwnProperty("raw"))throw Error("invalid template strings array");return Et!==void 0?Et.createHTML(e):e}var Mt=(r,e)=>{let t=r.length-1,i=[],s,n=e===2?"<svg>":e===3?"<math>":"",o=N;for(let l=0;l<t;l++){let a=r[l],h,f,u=-1,b=0;for(;b<a.length&&(o.lastIndex=b,f=o.exec(a),f!==null);)b=o.lastIndex,o===N?f[1]==="!--"?o=St:f[1]!==void 0?o=xt:f[2]!==void 0?(Pt.test(f[2])&&(s=RegExp("</"+f[2],"g")),o=E):f[3]!==void 0&&(o=E):o===E?f[0]===">"?(o=s??N,u=-1):f[1]===void 0?u=-2:(u=o.lastIndex-f[2].length,h=f[1],o=f[3]===void 0?E:f[3]==='"'?Tt:kt):o===Tt||o===kt?o=E:o===St||o===xt?o=N:(o=E,s=void 0);let _=o===E&&r[l+1].startsWith("/>")?" ":"";n+=o===N?a+ue:u>=0?(i.push(h),a.slice(0,u)+pt+a.slice(u)+w+_):a+w+(u===-2?l:_)}return[Ct(r,n+(r[t]||"<?>")+(e===2?"</svg>":e===3?"</math>":"")),i]},B=class r{constructor({strings:e,_$litType$:t},i){let s;this.parts=[];let n=0,o=0,l=e.length-1,a=this.parts,[h,f]=Mt(e,t);if(this.el=r.createElement(h,i),S.currentNode=this.el.content,t===2||t===3){let u=this.el.content.firstChild;u.replaceWith(...u.childNodes)}for(;(s=S.nextNode())!==null&&a.length<l;){if(s.nodeType===1){if(s.hasAttributes())for(let u of s.getAttributeNames())if(u.endsWith(pt)){let b=f[o++],_=s.getAttribute(u).split(w),Y=/([.?@])?(.*)/.exec(b);a.push({type:1,index:n,name:Y[2],strings:_,ctor:Y[1]==="."?Q:Y[1]==="?"?Z:Y[1]==="@"?tt:R}),s.removeAttribute(u)}else u.startsWith(w)&&(a.push({type:6,index:n}),s.removeAttribute(u));if(Pt.test(s.tagName)){let u=s.textContent.split(w),b=u.length-1;if(b>0){s.textContent=X?X.emptyScript:"";for(let _=0;_<b;_++)s.append(u[_],D()),S.nextNode(),a.push({type:2,index:++n});s.append(u[b],D())}}}else if(s.nodeType===8)if(s.data===ut)a.push({type:2,index:n});else{let u=-1;for(;(u=s.data.indexOf(w,u+1))!==-1;)a.push({type:7,index:n}),u+=w.length-1}n++}}static createElement(e,t){let i=x.createElement("template");return i.innerHTML=e,i}};function T(r,e,t=r,i){if(e===k)return e;let s=i!==void 0?t._$Co?.[i]:t._$Cl,n=j(e)?void 0:e._$litDirective$;return s?.constructor!==n&&(s?._$AO?.(!1),n===void 0?s=void 0:(s=new n(r),s._$AT(r,t,i)),i!==void 0?(t._$Co??=[])[i]=s:t._$Cl=s),s!==void 0&&(e=T(r,s._$AS(r,e.values),s,i)),e}var J=class{constructor(e,t){this._$AV=[],this._$AN=void 0,this._$AD=e,this._$AM=t}get parentNode(){return this._$AM.parentNode}get _$AU(){return this._$AM._$AU}u(e){let{el:{content:t},parts:i}=this._$AD,s=(e?.creationScope??x).importNode(t,!0);S.currentNode=s;let n=S.nextNode(),o=0,l=0,a=i[0];for(;a!==void 0;){if(o===a.index){let h;a.type===2?h=new C(n,n.nextSibling,this,e):a.type===1?h=new a.ctor(n,a.name,a.strings,this,e):a.type===6&&(h=new et(n,this,e)),this._$AV.push(h),a=i[++l]}o!==a?.index&&(n=S.nextNode(),o++)}return S.currentNode=x,s}p(e){let t=0;for(let i of this._$AV)i!==void 0&&(i.strings!==void 0?(i._$AI(e,i,t),t+=i.strings.length-2):i._$AI(e[t])),t++}},C=class r{get _$AU(){return this._$AM?._$AU??this._$Cv}constructor(e,t,i,s){this.type=2,this._$AH=c,this._$AN=void 0,this._$AA=e,this._$AB=t,this._$AM=i,this.options=s,this._$Cv=s?.isConnected??!0}get parentNode(){let e=this._$AA.parentNode,t=this._$AM;return t!==void 0&&e?.nodeType===11&&(e=t.parentNode),e}get startNode(){return this._$AA}get endNode(){return this._$AB}_$AI(e,t=this){e=T(this,e,t),j(e)?e===c||e==null||e===""?(this._$AH!==c&&this._$AR(),this._$AH=c):e!==this._$AH&&e!==k&&this._(e):e._$litType$!==void 0?this.$(e):e.nodeType!==void 0?this.T(e):Lt(e)?this.k(e):this._(e)}O(e){return this._$AA.parentNode.insertBefore(e,this._$AB)}T(e){this._$AH!==e&&(this._$AR(),this._$AH=this.O(e))}_(e){this._$AH!==c&&j(this._$AH)?this._$AA.nextSibling.data=e:this.T(x.createTextNode(e)),this._$AH=e}$(e){let{values:t,_$litType$:i}=e,s=typeof i=="number"?this._$AC(e):(i.el===void 0&&(i.el=B.createElement(Ct(i.h,i.h[0]),this.options)),i);if(this._$AH?._$AD===s)this._$AH.p(t);else{let n=new J(s,this),o=n.u(this.options);n.p(t),this.T(o),this._$AH=n}}_$AC(e){let t=Rt.get(e.strings);return t===void 0&&Rt.set(e.strings,t=new B(e)),t}k(e){mt(this._$AH)||(this._$AH=[],this._$AR());let t=this._$AH,i,s=0;for(let n of e)s===t.length?t.push(i=new r(this.O(D()),this.O(D()),this,this.options)):i=t[s],i._$AI(n),s++;s<t.length&&(this._$AR(i&&i._$AB.nextSibling,s),t.length=s)}_$AR(e=this._$AA.nextSibling,t){for(this._$AP?.(!1,!0,t);e!==this._$AB;){let i=At(e).nextSibling;At(e).remove(),e=i}}setConnected(e){this._$AM===void 0&&(this._$Cv=e,this._$AP?.(e))}},R=class{get tagName(){return this.element.tagName}get _$AU(){return this._$AM._$AU}constructor(e,t,i,s,n){this.type=1,this._$AH=c,this._$AN=void 0,this.element=e,this.name=t,this._$AM=s,this.options=n,i.length>2||i[0]!==""||i[1]!==""?(this._$AH=Array(i.length-1).fill(new String),this.strings=i):this._$AH=c}_$AI(e,t=this,i,s){let n=this.strings,o=!1;if(n===void 0)e=T(this,e,t,0),o=!j(e)||e!==this._$AH&&e!==k,o&&(this._$AH=e);else{let l=e,a,h;for(e=n[0],a=0;a<n.length-1;a++)h=T(this,l[i+a],t,a),h===k&&(h=this._$AH[a]),o||=!j(h)||h!==this._$AH[a],h===c?e=c:e!==c&&(e+=(h??"")+n[a+1]),this._$AH[a]=h}o&&!s&&this.j(e)}j(e){e===c?this.element.removeAttribute(this.name):this.element.setAttribute(this.name,e??"")}},Q=class extends R{constructor(){super(...arguments),this.type=3}j(e){this.element[this.name]=e===c?void 0:e}},Z=class extends R{constructor(){super(...arguments),this.type=4}j(e){this.element.toggleAttribute(this.name,!!e&&e!==c)}},tt=class extends R{constructor(e,t,i,s,n){super(e,t,i,s,n),this.type=5}_$AI(e,t=this){if((e=T(this,e,t,0)??c)===k)return;let i=this._$AH,s=e===c&&i!==c||e.capture!==i.capture||e.once!==i.once||e.passive!==i.passive,n=e!==c&&(i===c||s);s&&this.element.removeEventListener(this.name,this,i),n&&this.element.addEventListener(this.name,this,e),this._$AH=e}handleEvent(e){typeof this._$AH=="function"?this._$AH.call(this.options?.host??this.element,e):this._$AH.handleEvent(e)}},et=class{constructor(e,t,i){this.element=e,this.type=6,this._$AN=void 0,this._$AM=t,this.options=i}get _$AU(){return this._$AM._$AU}_$AI(e){T(this,e)}},Ot={M:pt,P:w,A:ut,C:1,L:Mt,R:J,D:Lt,V:T,I:C,H:R,N:Z,U:tt,B:Q,F:et},me=ct.litHtmlPolyfillSupport;me?.(B,C),(ct.litHtmlVersions??=[]).push("3.3.3");var Ht=(r,e,t)=>{let i=t?.renderBefore??e,s=i._$litPart$;if(s===void 0){let n=t?.renderBefore??null;i._$litPart$=s=new C(e.insertBefore(D(),n),n,void 0,t??{})}return s._$AI(r),s};var gt=globalThis,y=class extends ${constructor(){super(...arguments),this.renderOptions={host:this},this._$Do=void 0}createRenderRoot(){let e=super.createRenderRoot();return this.renderOptions.renderBefore??=e.firstChild,e}update(e){let t=this.render();this.hasUpdated||(this.renderOptions.isConnected=this.isConnected),super.update(e),this._$Do=Ht(t,this.renderRoot,this.renderOptions)}connectedCallback(){super.connectedCallback(),this._$Do?.setConnected(!0)}disconnectedCallback(){super.disconnectedCallback(),this._$Do?.setConnected(!1)}render(){return k}};y._$litElement$=!0,y.finalized=!0,gt.litElementHydrateSupport?.({LitElement:y});var fe=gt.litElementPolyfillSupport;fe?.({LitElement:y});(gt.litElementVersions??=[]).push("4.2.2");var ge={attribute:!0,type:String,converter:U,reflect:!1,hasChanged:G},ve=(r=ge,e,t)=>{let{kind:i,metadata:s}=t,n=globalThis.litPropertyMetadata.get(s);if(n===void 0&&globalThis.litPropertyMetadata.set(s,n=new Map),i==="setter"&&((r=Object.create(r)).wrapped=!0),n.set(t.name,r),i==="accessor"){let{name:o}=t;return{set(l){let a=e.get.call(this);e.set.call(this,l),this.requestUpdate(o,a,r,!0,l)},init(l){return l!==void 0&&this.C(o,void 0,r,l),l}}}if(i==="setter"){let{name:o}=t;return function(l){let a=this[o];e.call(this,l),this.requestUpdate(o,a,r,!0,l)}}throw Error("Unsupported decorator location: "+i)};function A(r){return(e,t)=>typeof t=="object"?ve(r,e,t):((i,s,n)=>{let o=s.hasOwnProperty(n);return s.constructor.createProperty(n,i),o?Object.getOwnPropertyDescriptor(s,n):void 0})(r,e,t)}function m(r){return A({...r,state:!0,attribute:!1})}var L=(r,e,t)=>(t.configurable=!0,t.enumerable=!0,Reflect.decorate&&typeof e!="object"&&Object.defineProperty(r,e,t),t);function M(r,e){return(t,i,s)=>{let n=o=>o.renderRoot?.querySelector(r)??null;if(e){let{get:o,set:l}=typeof i=="object"?t:s??(()=>{let a=Symbol();return{get(){return this[a]},set(h){this[a]=h}}})();return L(t,i,{get(){let a=o.call(this);return a===void 0&&(a=n(this),(a!==null||this.hasUpdated)&&l.call(this,a)),a}})}return L(t,i,{get(){return n(this)}})}}var It=r=>(...e)=>({_$litDirective$:r,values:e}),it=class{constructor(e){}get _$AU(){return this._$AM._$AU}_$AT(e,t,i){this._$Ct=e,this._$AM=t,this._$Ci=i}_$AS(e,t){return this.update(e,t)}update(e,t){return this.render(...t)}};var{I:Ei}=Ot;var ye={},Ut=(r,e=ye)=>r._$AH=e;var Nt=It(class extends it{constructor(){super(...arguments),this.key=c}render(r,e){return this.key=r,e}update(r,[e,t]){return e!==this.key&&(Ut(r),this.key=e),t}});async function vt(r){let e=Uint8Array.from(atob(r.textContent.trim()),i=>i.charCodeAt(0)),t=new Blob([e]).stream().pipeThrough(new DecompressionStream("deflate-raw"));return new Response(t).arrayBuffer()}var Dt=()=>vt(document.getElementById("chaic-module")),jt=()=>document.getElementById("chaic-worker").textContent;function Bt(r,e){let t=Math.floor(r/e);return`${Math.floor(t/60)}:${String(t%60).padStart(2,"0")}`}var qt={view:512,map:720};function Ft(r,e){let i=(r?.clientWidth??0)*devicePixelRatio;return Math.min(Math.max(64*Math.ceil(i/64),64),e)}function Wt(r,{width:e,height:t,rgba:i}){let s=r?.getContext("2d");!r||!s||((r.width!==e||r.height!==t)&&(r.width=e,r.height=t),s.putImageData(new ImageData(i,e,t),0,0))}var st=class{constructor(e){this.choices=e;this.timer=0}set(e){clearInterval(this.timer),this.timer=e?window.setInterval(()=>this.next(),1500):0}next(){let e=this.choices(),t=document.activeElement;for(;t?.shadowRoot?.activeElement;)t=t.shadowRoot.activeElement;let i=e.findIndex(s=>s===t);e[(i+1)%e.length]?.focus()}};var Yt=lt`
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
`;var zt=512,Vt=["none","rhp","oracle"],Kt=15,v=class extends y{constructor(){super(...arguments);this.workerSource="";this.story=[];this.references=new Map;this.isScanning=!1;this.pointing={kind:"pick_up",hand:"left"};this.isBusy=!1;this.isOver=!1;this.lastTime=0;this.elapsedFrames=0;this.scanTimer=0;this.recordedLength=0;this.recordedFrame=0;this.nTraceRequests=0}static{this.styles=Yt}disconnectedCallback(){super.disconnectedCallback(),this.close()}updated(t){t.has("game")&&this.game&&this.open(this.game)}close(){this.worker?.terminate(),this.worker=void 0,clearInterval(this.scanTimer),this.info=this.shown=this.problem=void 0,this.isScanning=!1,this.story=[],this.references=new Map,this.isOver=!1,this.recordedLength=this.recordedFrame=this.nTraceRequests=0}open(t){this.close();let i=URL.createObjectURL(new Blob([this.workerSource],{type:"text/javascript"}));this.worker=new Worker(i),URL.revokeObjectURL(i),this.worker.onmessage=a=>this.receive(a.data),this.worker.onerror=a=>this.fail(a.message||"the worker has stopped");let{module:s,episode:n,config:o,branch:l}=t;this.post({type:"play",module:s,episode:n,config:{...o,is_live:t.isLive},branch:l})}post(t){this.isBusy=!0,this.worker?.postMessage(t)}receive(t){switch(this.isBusy=!1,t.type){case"playing":this.info=t.info,this.updateComplete.then(()=>this.begin());break;case"live":this.show(t.state),Wt(this.canvas,t.view);break;case"trace":this.nTraceRequests-=1,this.game?.isStudy&&this.record(t.trace),this.isOver&&this.nTraceRequests===0&&this.finish(t.trace);break;case"reference":this.references=new Map(this.references).set(t.helper,t.rate),this.compareNext();break;case"error":this.fail(t.message);break}}fail(t){this.problem=t,this.game?.isStudy&&this.dispatchEvent(new CustomEvent("over",{detail:"left"}))}begin(){this.lastTime=performance.now(),this.elapsedFrames=1,requestAnimationFrame(t=>this.advance(t))}advance(t){if(!this.worker||this.problem||this.isOver)return;let i=(this.game?.speed??1)*(this.info?.frames_per_second??0);this.elapsedFrames+=Math.min(t-this.lastTime,250)/1e3*i,this.lastTime=t;let s=this.shown?.status==="waiting"&&!this.input&&!this.game?.isLive,n=Math.floor(this.elapsedFrames);if(!this.isBusy&&n>0&&(!s||this.input)){this.elapsedFrames-=n;let o=Ft(this.canvas,qt.view);this.post({type:"advance",frames:n,viewPx:o,input:this.input}),this.input&&(this.recordedFrame=-Kt),this.input=void 0}else s&&(this.elapsedFrames=Math.min(this.elapsedFrames,1));requestAnimationFrame(o=>this.advance(o))}show(t){let i=t.status==="waiting"&&this.shown?.status!=="waiting",s=i?[]:(this.shown?.plans??[]).filter(o=>t.plans.includes(o)),n=t.plans.filter(o=>!s.includes(o));this.shown={...t,plans:[...s,...n]},t.events.length>0&&(this.story=[...this.story,...t.events]),t.status==="ended"?this.stop():this.game?.isStudy&&(i||t.frame-this.recordedFrame>=Kt)&&(this.recordedFrame=t.frame,this.requestTrace()),i&&this.updateComplete.then(()=>this.focusChoices())}focusChoices(){let t=document.activeElement;t!==document.body&&t!==this||this.shadowRoot?.querySelector(".plans button")?.focus()}stop(){this.isOver||(this.isOver=!0,this.requestTrace())}requestTrace(){this.nTraceRequests+=1,this.post({type:"trace"})}record(t){let i=t.slice(this.recordedLength);this.recordedLength=t.length,i&&this.dispatchEvent(new CustomEvent("recorded",{detail:i}))}finish(t){let{episode:i,isStudy:s}=this.game;if(s){let n=this.shown?.status==="ended"?"ended":"stopped";this.dispatchEvent(new CustomEvent("over",{detail:n}));return}this.dispatchEvent(new CustomEvent("finished",{detail:{trace:t,episode:i}})),this.shown?.status==="ended"&&this.compareNext()}compareNext(){let t=Vt.find(i=>!this.references.has(i));t&&this.post({type:"reference",helper:t})}choose(t){let i=this.shown?.plans[t];this.shown?.status==="waiting"&&!this.isOver&&i!==void 0&&(this.input={plan:i})}act(t){this.shown?.status==="waiting"&&(this.input={action:t})}point(t){if(this.game?.config.level!=="steps")return;let i=t.currentTarget.getBoundingClientRect(),s=(h,f)=>Math.max(0,Math.min(zt-1,Math.floor(h/f*zt))),n={column:s(t.clientX-i.left,i.width),row:s(t.clientY-i.top,i.height)},{kind:o,hand:l}=this.pointing,a={pick_up:"object",put_on:"place",remove_obstacle:"obstacle"}[o];this.act({[o]:{[a]:{pixel:n},hand:l}})}press(t){let i=t.composedPath()[0];if(t.ctrlKey||t.altKey||t.metaKey||i.matches("select, input"))return;let s=this.game?.config.level==="steps",n=/^[1-9]$/.test(t.key)?Number(t.key)-1:void 0,l=s?{ArrowUp:"move_forward",ArrowLeft:"turn_left",ArrowRight:"turn_right",".":{wait:{frames:10}}}[t.key]:void 0;if(l)this.act(l);else if(!s&&n!==void 0)this.choose(n);else return;t.preventDefault()}scan(t){clearInterval(this.scanTimer),this.isScanning=t,t&&(this.scanTimer=window.setInterval(()=>this.focusNext(),1500))}focusNext(){let t=this.shadowRoot,i=[...t.querySelectorAll(".plans button")],s=i.findIndex(n=>n===t.activeElement);i[(s+1)%i.length]?.focus()}render(){let{info:t,shown:i}=this;return this.problem?d`<p class="problem" role="alert">Cannot play: ${this.problem}</p>`:t?d`<section aria-label="Play" @keydown=${s=>this.press(s)}>
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
          ${i?this.status(i):c}
          ${this.game?.config.level==="plans"?this.plans(i):this.steps(i)}
          ${this.isOver?c:d`<p><button type="button" class="link" @click=${()=>this.stop()}>Stop here</button></p>`}
          ${i?.status==="ended"&&!this.game?.isStudy?this.result(i):c} ${this.events()}
        </div>
      </div>
    </section>`:d`<p role="status">Loading ...</p>`}heading(t){let i=this.game?.config.seat===1,[s,n]=t.reach_m.map(l=>l.toFixed(2)),o=i?"The partner wants something that you do not know. Find out and help.":`Your body: ${t.person}. You want ${t.goal.join(", ")}.`;return d`<header>
      <h2>${t.task}: you are the ${i?"helper":"partner"}</h2>
      <p>${o} You reach from ${s} to ${n} m and lift ${t.strength_kg.toFixed(0)} kg.</p>
      <p class="small">${t.episode}. A simulation: real people differ from these bodies and views.</p>
    </header>`}time(t){return Bt(t,this.info?.frames_per_second??1)}status(t){let{action:i,plan:s}=t.caption,n=t.hands.map(l=>l??"nothing"),o=t.progress?`, ${t.progress[0]} of ${t.progress[1]} delivered`:"";return d`<p class="time">
        ${this.time(t.frame)} of ${this.time(t.horizon)}${o}
      </p>
      <p>Left hand: ${n[0]}; right hand: ${n[1]}</p>
      <p role="status">You: ${i}${s?` (${s})`:""}${t.failure?`; failed: ${t.failure}`:""}</p>`}plans(t){return d`<h3>What next?</h3>
      <ol class="plans">
        ${(t?.plans??[]).map((i,s)=>d`<li><button type="button" @click=${()=>this.choose(s)}>${i}</button></li>`)}
      </ol>
      ${t?.status==="running"?d`<p>Doing it ...</p>`:c}
      ${this.game?.isStudy?c:this.scanChoice()}`}scanChoice(){return d`<label>
        <input
          type="checkbox"
          .checked=${this.isScanning}
          @change=${t=>this.scan(t.target.checked)}
        />
        Offer one plan after the other, for a single switch
      </label>`}steps(t){let i=(o,l)=>d`<button type="button" @click=${()=>this.act(l)}>${o}</button>`,s=o=>{let[l,a]=o.target.value.split(" ");this.pointing={kind:l,hand:a}},n=[["pick_up left","picks up with the left hand"],["pick_up right","picks up with the right hand"],["put_on left","puts what the left hand holds there"],["put_on right","puts what the right hand holds there"],["remove_obstacle left","removes an obstacle"]];return d`<div class="controls" role="group" aria-label="Actions">
        ${i("Turn left (left arrow)","turn_left")} ${i("Walk (up arrow)","move_forward")}
        ${i("Turn right (right arrow)","turn_right")} ${i("Put into the container","put_in")}
        ${i("Wait (.)",{wait:{frames:10}})}
      </div>
      <label>
        A click on the picture
        <select @change=${s}>
          ${n.map(([o,l])=>d`<option value=${o}>${l}</option>`)}
        </select>
      </label>
      ${t?.status==="running"?d`<p>Acting ...</p>`:c}`}result(t){let[i,s]=t.progress??[0,0],n=s>0?i/s:0,o=a=>a===void 0?"...":`${(100*a).toFixed(0)} %`,l=this.game?.config.seat===1?"your help":"you as the partner";return d`<h3>Result</h3>
      <table>
        <caption>Delivered part of the goal, same episode and seed</caption>
        <tr><th scope="row">${l}</th><td class="number">${o(n)}</td></tr>
        ${Vt.map(a=>d`<tr>
            <th scope="row">simulated partner, ${a==="none"?"no helper":`helper ${a}`}</th>
            <td class="number">${o(this.references.get(a))}</td>
          </tr>`)}
      </table>`}events(){return d`<div class="story">
      <h3>Events</h3>
      <ol reversed>
        ${[...this.story].reverse().map(t=>d`<li><span class="time">${this.time(t.frame)}</span> ${t.text}</li>`)}
      </ol>
    </div>`}};p([A({attribute:!1})],v.prototype,"game",2),p([A({attribute:!1})],v.prototype,"workerSource",2),p([m()],v.prototype,"info",2),p([m()],v.prototype,"shown",2),p([m()],v.prototype,"story",2),p([m()],v.prototype,"problem",2),p([m()],v.prototype,"references",2),p([m()],v.prototype,"isScanning",2),p([m()],v.prototype,"pointing",2),p([M("canvas")],v.prototype,"canvas",2),p([m()],v.prototype,"isOver",2);customElements.define("chaic-play",v);function Gt(r,e){let t=r.slots[e-1]??[],i=[{kind:"instructions"}],s=o=>r.conditions[o]?.seat==="helper"?"partner":"helper";t.forEach((o,l)=>{i.push({kind:"trial",number:l,trial:o});let[a,h]=o,f=t[l+1]?.[0]!==a;if(!(a===0||!f))for(let u of r.after_condition)i.push({kind:"form",position:a,name:u,other:s(h)})});let n=t.at(-1)?.[1]??0;for(let o of r.at_end)i.push({kind:"form",position:0,name:o,other:s(n)});return[...i,{kind:"debrief"}]}function $e(r,e){return e.some(t=>{switch(r.kind){case"instructions":return t.type==="instructed";case"trial":return t.type==="trial_end"&&t.trial===r.number;case"form":return t.type==="answers"&&t.position===r.position&&t.form===r.name;case"debrief":return!1}})}function Xt(r,e){let t=r.findIndex(i=>!$e(i,e));return t<0?r.length-1:t}function Jt(r){let e=r.filter(i=>i.type==="trial").at(-1);return e&&!r.some(i=>i.type==="trial_end"&&i.trial===e.trial)?e.trial:void 0}var we=7,P=class extends y{constructor(){super(...arguments);this.other="helper";this.ratings={};this.isWarned=!1}createRenderRoot(){return this}missing(){return(this.form?.items??[]).filter(t=>this.ratings[t.id]===void 0)}nextInputs(){let[t]=this.missing();return t?[...this.querySelectorAll(`fieldset[data-item="${t.id}"] input`)]:[...this.querySelectorAll("button")]}submit(t){t.preventDefault();let i=this.missing();if(i.length>0&&!this.isWarned){this.isWarned=!0,this.querySelector(`fieldset[data-item="${i[0].id}"] input`)?.focus();return}let s=this.form.items.map(n=>[n.id,this.ratings[n.id]??null]);this.dispatchEvent(new CustomEvent("answered",{detail:Object.fromEntries(s)}))}render(){let{form:t}=this;if(!t)return d``;let i=this.missing().length,s=n=>n.replaceAll("{other}",this.other);return d`<form class="questions" @submit=${n=>this.submit(n)}>
      <p>${s(t.instruction)}</p>
      ${t.items.map(n=>this.item(t,n,s(n.text)))}
      ${this.isWarned&&i>0?d`<p role="alert">${i===1?"One question has":`${i} questions have`} no answer. You may leave them out: select Continue again.</p>`:c}
      <p><button>Continue</button></p>
    </form>`}item(t,i,s){let n=Math.floor((t.last-t.first)/t.step)+1,o=Array.from({length:n},(h,f)=>t.first+f*t.step),l=h=>{this.ratings={...this.ratings,[i.id]:h}},a=h=>h===t.first?`${h}, ${i.low}`:h===t.last?`${h}, ${i.high}`:String(h);return d`<fieldset data-item=${i.id}>
      <legend>${s}</legend>
      <p class="small" aria-hidden="true">${t.first}: ${i.low}, ${t.last}: ${i.high}</p>
      <div class="ratings" style="--n: ${n}; --narrow: ${Math.min(n,we)}">
        ${o.map(h=>d`<label class="rating">
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
    </fieldset>`}};p([A({attribute:!1})],P.prototype,"form",2),p([A()],P.prototype,"other",2),p([m()],P.prototype,"ratings",2),p([m()],P.prototype,"isWarned",2);customElements.define("chaic-form",P);var q="records",F="identity";function rt(r){return new Promise((e,t)=>{r.onsuccess=()=>e(r.result),r.onerror=()=>t(r.error)})}var _e=3e3;function Qt(r){return navigator.locks?new Promise(e=>{let t=()=>(e(!0),new Promise(()=>{}));navigator.locks.request(r,{signal:AbortSignal.timeout(_e)},t).catch(()=>e(!1))}):Promise.resolve(!0)}var W=class r{constructor(e,t,i){this.name=e;this.database=t;this.records=i;this.nStored=i.length}static async open(e,t){let i=indexedDB.open(e,1),s=!1;i.onupgradeneeded=()=>{t?(i.result.createObjectStore(q,{autoIncrement:!0}),i.result.createObjectStore(F)):(s=!0,i.transaction.abort())};try{let n=await rt(i),o=await rt(n.transaction(q).objectStore(q).getAll());return new r(e,n,o)}catch(n){if(s)return;throw n}}async append(e){this.records.push(e),await this.change(q,t=>t.add(e)),this.nStored+=1}async readIdentity(){return this.database.objectStoreNames.contains(F)?await rt(this.database.transaction(F).objectStore(F).get(1)):void 0}setIdentity(e){return this.change(F,t=>t.put(e,1))}async clear(){this.records.length=0,this.nStored=0,await this.change(q,e=>e.clear())}change(e,t){return new Promise((i,s)=>{let n=this.database.transaction(e,"readwrite",{durability:"strict"});n.oncomplete=()=>i(),n.onabort=n.onerror=()=>s(n.error),t(n.objectStore(e))})}async delete(){this.database.close(),await rt(indexedDB.deleteDatabase(this.name)),this.records.length=0}toText(){return this.records.map(e=>JSON.stringify(e)+`
`).join("")}};var Ae=[1e3,3e4],Ee=2e5,Se=2e4,xe=32;function Zt(){let r=crypto.getRandomValues(new Uint8Array(xe));return Array.from(r,e=>e.toString(16).padStart(2,"0")).join("")}var ke=({status:r})=>r===0||r===408||r===429||r>=500;function Te(r){let[e,t]=Ae;return new Promise(i=>{let s=()=>{clearTimeout(n),removeEventListener("online",s),i()},n=setTimeout(s,Math.min(e*2**r,t));addEventListener("online",s)})}var O=class{constructor(e){this.identity=e;this.aborted=new AbortController}abort(){this.aborted.abort()}async enter(){let{status:e,start:t,stored:i,error:s}=await this.repeated("PUT","");if(e===0)return"aborted";if(t&&i!==void 0)return{start:t,stored:i};if(e===410)return"full";if(e===401)return"taken";throw new Error(s??`the server answers ${e}`)}async delete(){let{status:e,error:t}=await this.repeated("DELETE","");if(e!==200&&e!==404)throw new Error(t??`the server answers ${e}`)}async repeated(e,t,i,s){for(let n=0;;n++){let o=await this.request(e,t,i);if(this.aborted.signal.aborted||!ke(o))return o;s?.(),await Te(n)}}async request(e,t,i){let{code:s,token:n}=this.identity;try{let o=await fetch(`participants/${s}${t}`,{method:e,body:i,headers:{Authorization:`Bearer ${n}`},cache:"no-store",keepalive:(i?.length??0)<Se,signal:AbortSignal.any([this.aborted.signal,AbortSignal.timeout(3e4)])});return{...await o.json(),status:o.status}}catch{return{status:0}}}},nt=class{constructor(e,t,i,s){this.participant=e;this.log=t;this.stored=i;this.onChange=s;this.state="sending";this.problem="";this.isRunning=!1}stop(){this.participant.abort()}async send(){if(!(this.isRunning||this.state==="refused")){for(this.isRunning=!0;this.stored===void 0||this.stored<this.log.nStored;){let e=this.stored;this.state==="saved"&&this.set("sending");let t=e===void 0?await this.participant.repeated("GET","",void 0,()=>this.set("waiting")):await this.participant.repeated("PUT",`/records/${e}`,this.batch(e),()=>this.set("waiting"));if(t.status===0)return;if(t.stored===void 0||t.stored>this.log.records.length){this.problem=t.error??"the server has more data than this browser",this.set("refused");return}this.stored=t.stored}this.isRunning=!1,this.set("saved")}}set(e){e!==this.state&&(this.state=e,this.onChange())}batch(e){let t="";for(let i of this.log.records.slice(e,this.log.nStored)){let s=JSON.stringify(i)+`
`;if(t!==""&&t.length+s.length>Ee)break;t+=s}return t}};function te(r){let[e=""]=r,t=/^(#{1,2}) (.*)$/.exec(e);if(t){let i=r.length>1?te(r.slice(1)):d``;return t[1]==="#"?d`<h2>${t[2]}</h2>${i}`:d`<h3>${t[2]}</h3>${i}`}return r.every(i=>i.startsWith("- "))?d`<ul>${r.map(i=>d`<li>${i.slice(2)}</li>`)}</ul>`:d`<p>${r.join(" ")}</p>`}function ot(r){return r.split(/\r?\n[ \t]*\r?\n/).map(t=>t.split(/\r?\n/).map(i=>i.trim())).map(t=>t.filter(i=>i!=="")).filter(t=>t.length>0).map(te)}var ee="ABCDEFGHJKLMNPQRSTUVWXYZ23456789",Re=10;function ie(){let r=crypto.getRandomValues(new Uint8Array(Re));return Array.from(r,e=>ee[e%ee.length]).join("")}var g=class extends y{constructor(){super(...arguments);this.isLoading=!0;this.steps=[];this.at=0;this.playing="before";this.isResumed=!1;this.isScanning=!1;this.hasLeft=!1;this.scanner=new st(()=>this.choices())}createRenderRoot(){return this}connectedCallback(){super.connectedCallback(),addEventListener("hashchange",()=>location.reload()),addEventListener("unhandledrejection",t=>this.fail(t.reason)),this.load().catch(t=>this.fail(t))}fail(t){this.problem=t instanceof Error?t.message:String(t)}async load(){let t=await vt(document.getElementById("chaic-study")),i=JSON.parse(new TextDecoder().decode(t));if(this.content=i,!i.server&&!this.takeSlot(Number(/^#(\d{1,5})$/.exec(location.hash)?.[1]))){this.isLoading=!1;return}if(!await Qt(this.logName())){this.problem="it is open in another tab. Go on there, or close that tab and load this page again.";return}let s=await W.open(this.logName(),!1),n=await s?.readIdentity();s&&n?await this.resumeWithServer(s,n):s?.records.length&&await this.resume(s),this.isLoading=!1}takeSlot(t){return this.content?.slots[t-1]?(this.slotNumber=t,this.steps=Gt(this.content,t),!0):!1}logName(){let{digest:t,server:i}=this.content;return`chaic-study-${t}-${i?"server":this.slotNumber}`}async resumeWithServer(t,i){let[s]=t.records;i.isLeaving?(this.hasLeft=!0,this.deleteEverywhere(t,i)):s?.type!=="start"?this.enter(t,i):(this.takeSlot(s.slot),this.startUpload(t,new O(i),void 0),await this.resume(t))}startUpload(t,i,s){let n=()=>{this.upload?.state==="refused"&&this.fail(`${this.upload.problem}. Your data are kept in this browser.`),this.requestUpdate()};this.upload=new nt(i,t,s,n),this.upload.send()}async store(t){await this.log?.append(t),this.upload?.send()}async resume(t){this.log=t,this.isResumed=!0;let i=Jt(t.records);i!==void 0&&await this.store({type:"trial_end",trial:i,outcome:"left"}),this.at=Xt(this.steps,t.records)}async agree(){let{format:t,version:i,chaic:s,digest:n,server:o}=this.content;o&&(this.waits="entry");let l=await W.open(this.logName(),!0);if(!l)return;if(o){await this.enter(l);return}let a={format:t,version:i,chaic:s,study:n,code:ie(),slot:this.slotNumber};await l.append({type:"start",...a}),this.log=l,this.focusHeading()}async enter(t,i){let s=i??{code:ie(),token:Zt(),isLeaving:!1};i||await t.setIdentity(s);let n=new O(s);this.entering={log:t,participant:n},this.waits="entry";let o=await n.enter();o!=="aborted"&&(this.entering=void 0,o==="taken"?await this.enter(t):o==="full"?(await t.delete(),this.waits="full",this.focusHeading()):o.start.type==="start"&&this.takeSlot(o.start.slot)&&(await t.append(o.start),this.waits=void 0,this.log=t,this.startUpload(t,n,o.stored),this.focusHeading()))}async advance(t){t&&await this.store(t),this.at+=1,this.playing="before",this.game=void 0,this.isResumed=!1;let i=this.steps[this.at]?.kind==="debrief",s=this.log?.records.some(n=>n.type==="complete");i&&!s&&await this.store({type:"complete"}),this.focusHeading()}async leave(){this.dialog?.close(),this.playing="before",this.game=void 0;let{entering:t,upload:i}=this,s=this.log??t?.log;this.log=void 0,this.entering=void 0,this.hasLeft=!0,t?.participant.abort(),i?.stop();let n=await s?.readIdentity();this.focusHeading(),s&&n?await this.deleteEverywhere(s,n):await s?.delete()}async deleteEverywhere(t,i){this.waits="deletion",await t.setIdentity({...i,isLeaving:!0}),await t.clear(),await new O(i).delete(),await t.delete(),this.waits=void 0}async removeCopy(){let{log:t}=this;this.upload?.stop(),this.log=void 0,this.waits="removed",await t?.delete(),this.focusHeading()}focusHeading(){this.updateComplete.then(()=>{this.querySelector("h1")?.focus(),scrollTo(0,0)})}code(){let[t]=this.log?.records??[];return t?.type==="start"?t.code:""}async startTrial(t){let{content:i,log:s}=this;if(!i||!s)return;this.module??=await Dt();let[,n,o,l]=t.trial,{seat:a,input:h}=i.conditions[n];await this.store({type:"trial",trial:t.number}),this.game={module:this.module,episode:new TextEncoder().encode(i.episodes[o]),config:{seed:i.seed,seat:a==="partner"?0:1,level:h,helper:l},isLive:i.play.world==="goes_on",speed:i.play.speed,isStudy:!0},this.playing="running"}endTrial(t,i){this.store({type:"trial_end",trial:t,outcome:i}).then(()=>{this.playing="over",this.updateComplete.then(()=>this.querySelector("#continue")?.focus())})}download(){let t=document.createElement("a");t.href=URL.createObjectURL(new Blob([this.log?.toText()??""],{type:"application/jsonl"})),t.download=`${this.code()}.jsonl`,t.click(),URL.revokeObjectURL(t.href)}choices(){let t=(o,l)=>[...o.querySelectorAll(l)].filter(a=>a.checkVisibility());if(this.dialog?.open)return t(this.dialog,"button");let i=t(this,"#leave");if(this.form)return[...this.form.nextInputs(),...i];let s=this.playing==="running"?this.player?.shadowRoot:void 0;return[...s?t(s,".plans button, .controls button, button.link"):[],...t(this,".step > p > button"),...i]}press(t){let i=t.target;t.key!=="Enter"||!i.matches("input[type=radio], input[type=checkbox]")||(t.preventDefault(),i.click())}render(){let t=this.log?`Part ${this.at+1} of ${this.steps.length}`:"";return d`<div class="study" @keydown=${i=>this.press(i)}>
      ${this.bar()}
      <section class="step">
        ${this.problem?d`<p class="problem" role="alert">The study cannot go on: ${this.problem}</p>`:c}
        <p class="small" role="status">${t}</p>
        <p class="small" role="status">
          ${this.upload?.state==="waiting"&&!this.hasLeft?"There is no connection to the server. Go on: your data are kept in this browser and sent later.":c}
        </p>
        ${this.current()}
      </section>
      ${this.question()}
    </div>`}bar(){let t=i=>{this.isScanning=i.target.checked,this.scanner.set(this.isScanning)};return d`<div class="bar" role="group" aria-label="Study">
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
          <p>The copy in this browser is removed. The next participant can load this page again.</p>`}if(this.slotNumber===void 0&&!t.server)return this.slotQuestion(t);if(!this.log)return this.consent(t);let i=this.steps[this.at];switch(i.kind){case"instructions":return this.instructions(t);case"trial":return this.trial(i);case"form":return this.questions(t,i);case"debrief":return this.debrief(t)}}heading(t){return d`<h1 tabindex="-1">${t}</h1>`}slotQuestion({title:t,slots:i}){let s=n=>{n.preventDefault();let o=new FormData(n.target).get("slot");location.hash=`#${Number(o)}`};return d`${this.heading(t)}
      <form @submit=${s}>
        <label>
          Your participant number, 1 to ${i.length}
          <input type="number" name="slot" min="1" max=${i.length} required />
        </label>
        <button>Continue</button>
      </form>`}consent({title:t,consent:i}){return d`${this.heading(t)} ${ot(i)}
      <p class="small">Nothing is stored before you agree.</p>
      <p>
        <button type="button" @click=${()=>{this.agree()}}>I agree and take part</button>
        <button type="button" @click=${()=>{this.leave()}}>I do not take part</button>
      </p>`}instructions({instructions:t}){return d`${this.heading("Instructions")} ${ot(t)}
      <p>Your code is <b class="code">${this.code()}</b>. Keep it: with it, the researchers can delete your data later.</p>
      <p><button type="button" @click=${()=>{this.advance({type:"instructed"})}}>Continue</button></p>`}trial(t){let i=this.steps.filter(o=>o.kind==="trial"),s=t.trial[0]===0,n=`Episode ${t.number+1} of ${i.length}${s?", practice":""}`;return this.playing==="before"?d`${this.heading(n)}
        ${this.isResumed?d`<p>The study goes on here. An episode that was interrupted is not repeated.</p>`:c}
        <p>${s?"This episode is for practice.":"This episode counts."}</p>
        <p><button type="button" @click=${()=>{this.startTrial(t)}}>Start the episode</button></p>`:d`${this.heading(n)}
      <chaic-play
        .workerSource=${jt()}
        .game=${this.game}
        @recorded=${o=>{this.store({type:"trace",trial:t.number,text:o.detail})}}
        @over=${o=>this.endTrial(t.number,o.detail)}
      ></chaic-play>
      ${this.playing==="over"?d`<p>The episode is over. <button type="button" id="continue" @click=${()=>{this.advance()}}>Continue</button></p>`:c}`}questions(t,i){let s=t.forms[i.name],n=o=>{let{position:l,name:a}=i;this.advance({type:"answers",position:l,form:a,ratings:o.detail})};return d`${this.heading(s.title)}
      ${Nt(`${i.position} ${i.name}`,d`<chaic-form .form=${s} .other=${i.other} @answered=${n}></chaic-form>`)}`}debrief(t){return d`${this.heading("The end")} ${ot(t.debrief)}
      <p>Completion code: <b class="code">${t.completion_code}</b></p>
      <p>Your code: <b class="code">${this.code()}</b>. With it, the researchers can delete your data.</p>
      <p>
        <button type="button" @click=${()=>this.download()}>Download your data</button>
      </p>
      <p class="small">The file has your answers and your decisions. It has no name, no address and no times of day.
        "Stop and delete" removes ${t.server?"all your data, also on the server":"the copy in this browser"}.</p>
      ${this.upload?this.uploaded(this.upload):c}`}uploaded({state:t}){return t!=="saved"?d`<p role="status">The server does not have all your data yet. Keep this page open, or open it again
        later. If that does not help, download your data and send them to the researchers.</p>`:d`<p role="status">The server has all your data. You may close this page.</p>
      <p><button type="button" @click=${()=>{this.removeCopy()}}>Remove the copy in this browser</button></p>`}};p([m()],g.prototype,"content",2),p([m()],g.prototype,"isLoading",2),p([m()],g.prototype,"slotNumber",2),p([m()],g.prototype,"log",2),p([m()],g.prototype,"steps",2),p([m()],g.prototype,"at",2),p([m()],g.prototype,"playing",2),p([m()],g.prototype,"isResumed",2),p([m()],g.prototype,"isScanning",2),p([m()],g.prototype,"hasLeft",2),p([m()],g.prototype,"problem",2),p([m()],g.prototype,"waits",2),p([M("dialog")],g.prototype,"dialog",2),p([M("chaic-play")],g.prototype,"player",2),p([M("chaic-form")],g.prototype,"form",2);customElements.define("chaic-study",g);})();
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
