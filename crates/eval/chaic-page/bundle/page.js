"use strict";(()=>{var Yt=Object.defineProperty;var Jt=Object.getOwnPropertyDescriptor;var v=(i,t,e,s)=>{for(var r=s>1?void 0:s?Jt(t,e):t,o=i.length-1,n;o>=0;o--)(n=i[o])&&(r=(s?n(t,e,r):n(r))||r);return s&&r&&Yt(t,e,r),r};var ce=globalThis,he=ce.ShadowRoot&&(ce.ShadyCSS===void 0||ce.ShadyCSS.nativeShadow)&&"adoptedStyleSheets"in Document.prototype&&"replace"in CSSStyleSheet.prototype,Oe=Symbol(),rt=new WeakMap,Z=class{constructor(t,e,s){if(this._$cssResult$=!0,s!==Oe)throw Error("CSSResult is not constructable. Use `unsafeCSS` or `css` instead.");this.cssText=t,this.t=e}get styleSheet(){let t=this.o,e=this.t;if(he&&t===void 0){let s=e!==void 0&&e.length===1;s&&(t=rt.get(e)),t===void 0&&((this.o=t=new CSSStyleSheet).replaceSync(this.cssText),s&&rt.set(e,t))}return t}toString(){return this.cssText}},it=i=>new Z(typeof i=="string"?i:i+"",void 0,Oe),He=(i,...t)=>{let e=i.length===1?i[0]:t.reduce((s,r,o)=>s+(n=>{if(n._$cssResult$===!0)return n.cssText;if(typeof n=="number")return n;throw Error("Value passed to 'css' function must be a 'css' function result: "+n+". Use 'unsafeCSS' to pass non-literal values, but take care to ensure page security.")})(r)+i[o+1],i[0]);return new Z(e,i,Oe)},nt=(i,t)=>{if(he)i.adoptedStyleSheets=t.map(e=>e instanceof CSSStyleSheet?e:e.styleSheet);else for(let e of t){let s=document.createElement("style"),r=ce.litNonce;r!==void 0&&s.setAttribute("nonce",r),s.textContent=e.cssText,i.appendChild(s)}},De=he?i=>i:i=>i instanceof CSSStyleSheet?(t=>{let e="";for(let s of t.cssRules)e+=s.cssText;return it(e)})(i):i;var{is:Zt,defineProperty:Qt,getOwnPropertyDescriptor:es,getOwnPropertyNames:ts,getOwnPropertySymbols:ss,getPrototypeOf:rs}=Object,pe=globalThis,ot=pe.trustedTypes,is=ot?ot.emptyScript:"",ns=pe.reactiveElementPolyfillSupport,Q=(i,t)=>i,ee={toAttribute(i,t){switch(t){case Boolean:i=i?is:null;break;case Object:case Array:i=i==null?i:JSON.stringify(i)}return i},fromAttribute(i,t){let e=i;switch(t){case Boolean:e=i!==null;break;case Number:e=i===null?null:Number(i);break;case Object:case Array:try{e=JSON.parse(i)}catch{e=null}}return e}},de=(i,t)=>!Zt(i,t),at={attribute:!0,type:String,converter:ee,reflect:!1,useDefault:!1,hasChanged:de};Symbol.metadata??=Symbol("metadata"),pe.litPropertyMetadata??=new WeakMap;var T=class extends HTMLElement{static addInitializer(t){this._$Ei(),(this.l??=[]).push(t)}static get observedAttributes(){return this.finalize(),this._$Eh&&[...this._$Eh.keys()]}static createProperty(t,e=at){if(e.state&&(e.attribute=!1),this._$Ei(),this.prototype.hasOwnProperty(t)&&((e=Object.create(e)).wrapped=!0),this.elementProperties.set(t,e),!e.noAccessor){let s=Symbol(),r=this.getPropertyDescriptor(t,s,e);r!==void 0&&Qt(this.prototype,t,r)}}static getPropertyDescriptor(t,e,s){let{get:r,set:o}=es(this.prototype,t)??{get(){return this[e]},set(n){this[e]=n}};return{get:r,set(n){let a=r?.call(this);o?.call(this,n),this.requestUpdate(t,a,s)},configurable:!0,enumerable:!0}}static getPropertyOptions(t){return this.elementProperties.get(t)??at}static _$Ei(){if(this.hasOwnProperty(Q("elementProperties")))return;let t=rs(this);t.finalize(),t.l!==void 0&&(this.l=[...t.l]),this.elementProperties=new Map(t.elementProperties)}static finalize(){if(this.hasOwnProperty(Q("finalized")))return;if(this.finalized=!0,this._$Ei(),this.hasOwnProperty(Q("properties"))){let e=this.properties,s=[...ts(e),...ss(e)];for(let r of s)this.createProperty(r,e[r])}let t=this[Symbol.metadata];if(t!==null){let e=litPropertyMetadata.get(t);if(e!==void 0)for(let[s,r]of e)this.elementProperties.set(s,r)}this._$Eh=new Map;for(let[e,s]of this.elementProperties){let r=this._$Eu(e,s);r!==void 0&&this._$Eh.set(r,e)}this.elementStyles=this.finalizeStyles(this.styles)}static finalizeStyles(t){let e=[];if(Array.isArray(t)){let s=new Set(t.flat(1/0).reverse());for(let r of s)e.unshift(De(r))}else t!==void 0&&e.push(De(t));return e}static _$Eu(t,e){let s=e.attribute;return s===!1?void 0:typeof s=="string"?s:typeof t=="string"?t.toLowerCase():void 0}constructor(){super(),this._$Ep=void 0,this.isUpdatePending=!1,this.hasUpdated=!1,this._$Em=null,this._$Ev()}_$Ev(){this._$ES=new Promise(t=>this.enableUpdating=t),this._$AL=new Map,this._$E_(),this.requestUpdate(),this.constructor.l?.forEach(t=>t(this))}addController(t){(this._$EO??=new Set).add(t),this.renderRoot!==void 0&&this.isConnected&&t.hostConnected?.()}removeController(t){this._$EO?.delete(t)}_$E_(){let t=new Map,e=this.constructor.elementProperties;for(let s of e.keys())this.hasOwnProperty(s)&&(t.set(s,this[s]),delete this[s]);t.size>0&&(this._$Ep=t)}createRenderRoot(){let t=this.shadowRoot??this.attachShadow(this.constructor.shadowRootOptions);return nt(t,this.constructor.elementStyles),t}connectedCallback(){this.renderRoot??=this.createRenderRoot(),this.enableUpdating(!0),this._$EO?.forEach(t=>t.hostConnected?.())}enableUpdating(t){}disconnectedCallback(){this._$EO?.forEach(t=>t.hostDisconnected?.())}attributeChangedCallback(t,e,s){this._$AK(t,s)}_$ET(t,e){let s=this.constructor.elementProperties.get(t),r=this.constructor._$Eu(t,s);if(r!==void 0&&s.reflect===!0){let o=(s.converter?.toAttribute!==void 0?s.converter:ee).toAttribute(e,s.type);this._$Em=t,o==null?this.removeAttribute(r):this.setAttribute(r,o),this._$Em=null}}_$AK(t,e){let s=this.constructor,r=s._$Eh.get(t);if(r!==void 0&&this._$Em!==r){let o=s.getPropertyOptions(r),n=typeof o.converter=="function"?{fromAttribute:o.converter}:o.converter?.fromAttribute!==void 0?o.converter:ee;this._$Em=r;let a=n.fromAttribute(e,o.type);this[r]=a??this._$Ej?.get(r)??a,this._$Em=null}}requestUpdate(t,e,s,r=!1,o){if(t!==void 0){let n=this.constructor;if(r===!1&&(o=this[t]),s??=n.getPropertyOptions(t),!((s.hasChanged??de)(o,e)||s.useDefault&&s.reflect&&o===this._$Ej?.get(t)&&!this.hasAttribute(n._$Eu(t,s))))return;this.C(t,e,s)}this.isUpdatePending===!1&&(this._$ES=this._$EP())}C(t,e,{useDefault:s,reflect:r,wrapped:o},n){s&&!(this._$Ej??=new Map).has(t)&&(this._$Ej.set(t,n??e??this[t]),o!==!0||n!==void 0)||(this._$AL.has(t)||(this.hasUpdated||s||(e=void 0),this._$AL.set(t,e)),r===!0&&this._$Em!==t&&(this._$Eq??=new Set).add(t))}async _$EP(){this.isUpdatePending=!0;try{await this._$ES}catch(e){Promise.reject(e)}let t=this.scheduleUpdate();return t!=null&&await t,!this.isUpdatePending}scheduleUpdate(){return this.performUpdate()}performUpdate(){if(!this.isUpdatePending)return;if(!this.hasUpdated){if(this.renderRoot??=this.createRenderRoot(),this._$Ep){for(let[r,o]of this._$Ep)this[r]=o;this._$Ep=void 0}let s=this.constructor.elementProperties;if(s.size>0)for(let[r,o]of s){let{wrapped:n}=o,a=this[r];n!==!0||this._$AL.has(r)||a===void 0||this.C(r,void 0,o,a)}}let t=!1,e=this._$AL;try{t=this.shouldUpdate(e),t?(this.willUpdate(e),this._$EO?.forEach(s=>s.hostUpdate?.()),this.update(e)):this._$EM()}catch(s){throw t=!1,this._$EM(),s}t&&this._$AE(e)}willUpdate(t){}_$AE(t){this._$EO?.forEach(e=>e.hostUpdated?.()),this.hasUpdated||(this.hasUpdated=!0,this.firstUpdated(t)),this.updated(t)}_$EM(){this._$AL=new Map,this.isUpdatePending=!1}get updateComplete(){return this.getUpdateComplete()}getUpdateComplete(){return this._$ES}shouldUpdate(t){return!0}update(t){this._$Eq&&=this._$Eq.forEach(e=>this._$ET(e,this[e])),this._$EM()}updated(t){}firstUpdated(t){}};T.elementStyles=[],T.shadowRootOptions={mode:"open"},T[Q("elementProperties")]=new Map,T[Q("finalized")]=new Map,ns?.({ReactiveElement:T}),(pe.reactiveElementVersions??=[]).push("2.1.2");var Ue=globalThis,lt=i=>i,me=Ue.trustedTypes,ct=me?me.createPolicy("lit-html",{createHTML:i=>i}):void 0,Ne="$lit$",C=`lit$${Math.random().toFixed(9).slice(2)}$`,Be="?"+C,os=`<${Be}>`,j=document,se=()=>j.createComment(""),re=i=>i===null||typeof i!="object"&&typeof i!="function",Fe=Array.isArray,ft=i=>Fe(i)||typeof i?.[Symbol.iterator]=="function",je=`[ 	
\f\r]`,te=/<(?:(!--|\/[^a-zA-Z])|(\/?[a-zA-Z][^>\s]*)|(\/?$))/g,ht=/-->/g,pt=/>/g,H=RegExp(`>|${je}(?:([^\\s"'>=/]+)(${je}*=${je}*(?:[^ 	
\f\r"'\`<>=]|("|')|))|$)`,"g"),dt=/'/g,mt=/"/g,vt=/^(?:script|style|textarea|title)$/i,qe=i=>(t,...e)=>({_$litType$:i,strings:t,values:e}),p=qe(1),w=qe(2),qs=qe(3),A=Symbol.for("lit-noChange"),m=Symbol.for("lit-nothing"),ut=new WeakMap,D=j.createTreeWalker(j,129);function gt(i,t){if(!Fe(i)||!i.hasOwnProperty("raw"))throw Error("invalid template strings array");return ct!==void 0?ct.createHTML(t):t}var yt=(i,t)=>{let e=i.length-1,s=[],r,o=t===2?"<svg>":t===3?"<math>":"",n=te;for(let a=0;a<e;a++){let l=i[a],c,d,h=-1,u=0;for(;u<l.length&&(n.lastIndex=u,d=n.exec(l),d!==null);)u=n.lastIndex,n===te?d[1]==="!--"?n=ht:d[1]!==void 0?n=pt:d[2]!==void 0?(vt.test(d[2])&&(r=RegExp("</"+d[2],"g")),n=H):d[3]!==void 0&&(n=H):n===H?d[0]===">"?(n=r??te,h=-1):d[1]===void 0?h=-2:(h=n.lastIndex-d[2].length,c=d[1],n=d[3]===void 0?H:d[3]==='"'?mt:dt):n===mt||n===dt?n=H:n===ht||n===pt?n=te:(n=H,r=void 0);let f=n===H&&i[a+1].startsWith("/>")?" ":"";o+=n===te?l+os:h>=0?(s.push(c),l.slice(0,h)+Ne+l.slice(h)+C+f):l+C+(h===-2?a:f)}return[gt(i,o+(i[e]||"<?>")+(t===2?"</svg>":t===3?"</math>":"")),s]},ie=class i{constructor({strings:t,_$litType$:e},s){let r;this.parts=[];let o=0,n=0,a=t.length-1,l=this.parts,[c,d]=yt(t,e);if(this.el=i.createElement(c,s),D.currentNode=this.el.content,e===2||e===3){let h=this.el.content.firstChild;h.replaceWith(...h.childNodes)}for(;(r=D.nextNode())!==null&&l.length<a;){if(r.nodeType===1){if(r.hasAttributes())for(let h of r.getAttributeNames())if(h.endsWith(Ne)){let u=d[n++],f=r.getAttribute(h).split(C),g=/([.?@])?(.*)/.exec(u);l.push({type:1,index:o,name:g[2],strings:f,ctor:g[1]==="."?fe:g[1]==="?"?ve:g[1]==="@"?ge:N}),r.removeAttribute(h)}else h.startsWith(C)&&(l.push({type:6,index:o}),r.removeAttribute(h));if(vt.test(r.tagName)){let h=r.textContent.split(C),u=h.length-1;if(u>0){r.textContent=me?me.emptyScript:"";for(let f=0;f<u;f++)r.append(h[f],se()),D.nextNode(),l.push({type:2,index:++o});r.append(h[u],se())}}}else if(r.nodeType===8)if(r.data===Be)l.push({type:2,index:o});else{let h=-1;for(;(h=r.data.indexOf(C,h+1))!==-1;)l.push({type:7,index:o}),h+=C.length-1}o++}}static createElement(t,e){let s=j.createElement("template");return s.innerHTML=t,s}};function U(i,t,e=i,s){if(t===A)return t;let r=s!==void 0?e._$Co?.[s]:e._$Cl,o=re(t)?void 0:t._$litDirective$;return r?.constructor!==o&&(r?._$AO?.(!1),o===void 0?r=void 0:(r=new o(i),r._$AT(i,e,s)),s!==void 0?(e._$Co??=[])[s]=r:e._$Cl=r),r!==void 0&&(t=U(i,r._$AS(i,t.values),r,s)),t}var ue=class{constructor(t,e){this._$AV=[],this._$AN=void 0,this._$AD=t,this._$AM=e}get parentNode(){return this._$AM.parentNode}get _$AU(){return this._$AM._$AU}u(t){let{el:{content:e},parts:s}=this._$AD,r=(t?.creationScope??j).importNode(e,!0);D.currentNode=r;let o=D.nextNode(),n=0,a=0,l=s[0];for(;l!==void 0;){if(n===l.index){let c;l.type===2?c=new z(o,o.nextSibling,this,t):l.type===1?c=new l.ctor(o,l.name,l.strings,this,t):l.type===6&&(c=new ye(o,this,t)),this._$AV.push(c),l=s[++a]}n!==l?.index&&(o=D.nextNode(),n++)}return D.currentNode=j,r}p(t){let e=0;for(let s of this._$AV)s!==void 0&&(s.strings!==void 0?(s._$AI(t,s,e),e+=s.strings.length-2):s._$AI(t[e])),e++}},z=class i{get _$AU(){return this._$AM?._$AU??this._$Cv}constructor(t,e,s,r){this.type=2,this._$AH=m,this._$AN=void 0,this._$AA=t,this._$AB=e,this._$AM=s,this.options=r,this._$Cv=r?.isConnected??!0}get parentNode(){let t=this._$AA.parentNode,e=this._$AM;return e!==void 0&&t?.nodeType===11&&(t=e.parentNode),t}get startNode(){return this._$AA}get endNode(){return this._$AB}_$AI(t,e=this){t=U(this,t,e),re(t)?t===m||t==null||t===""?(this._$AH!==m&&this._$AR(),this._$AH=m):t!==this._$AH&&t!==A&&this._(t):t._$litType$!==void 0?this.$(t):t.nodeType!==void 0?this.T(t):ft(t)?this.k(t):this._(t)}O(t){return this._$AA.parentNode.insertBefore(t,this._$AB)}T(t){this._$AH!==t&&(this._$AR(),this._$AH=this.O(t))}_(t){this._$AH!==m&&re(this._$AH)?this._$AA.nextSibling.data=t:this.T(j.createTextNode(t)),this._$AH=t}$(t){let{values:e,_$litType$:s}=t,r=typeof s=="number"?this._$AC(t):(s.el===void 0&&(s.el=ie.createElement(gt(s.h,s.h[0]),this.options)),s);if(this._$AH?._$AD===r)this._$AH.p(e);else{let o=new ue(r,this),n=o.u(this.options);o.p(e),this.T(n),this._$AH=o}}_$AC(t){let e=ut.get(t.strings);return e===void 0&&ut.set(t.strings,e=new ie(t)),e}k(t){Fe(this._$AH)||(this._$AH=[],this._$AR());let e=this._$AH,s,r=0;for(let o of t)r===e.length?e.push(s=new i(this.O(se()),this.O(se()),this,this.options)):s=e[r],s._$AI(o),r++;r<e.length&&(this._$AR(s&&s._$AB.nextSibling,r),e.length=r)}_$AR(t=this._$AA.nextSibling,e){for(this._$AP?.(!1,!0,e);t!==this._$AB;){let s=lt(t).nextSibling;lt(t).remove(),t=s}}setConnected(t){this._$AM===void 0&&(this._$Cv=t,this._$AP?.(t))}},N=class{get tagName(){return this.element.tagName}get _$AU(){return this._$AM._$AU}constructor(t,e,s,r,o){this.type=1,this._$AH=m,this._$AN=void 0,this.element=t,this.name=e,this._$AM=r,this.options=o,s.length>2||s[0]!==""||s[1]!==""?(this._$AH=Array(s.length-1).fill(new String),this.strings=s):this._$AH=m}_$AI(t,e=this,s,r){let o=this.strings,n=!1;if(o===void 0)t=U(this,t,e,0),n=!re(t)||t!==this._$AH&&t!==A,n&&(this._$AH=t);else{let a=t,l,c;for(t=o[0],l=0;l<o.length-1;l++)c=U(this,a[s+l],e,l),c===A&&(c=this._$AH[l]),n||=!re(c)||c!==this._$AH[l],c===m?t=m:t!==m&&(t+=(c??"")+o[l+1]),this._$AH[l]=c}n&&!r&&this.j(t)}j(t){t===m?this.element.removeAttribute(this.name):this.element.setAttribute(this.name,t??"")}},fe=class extends N{constructor(){super(...arguments),this.type=3}j(t){this.element[this.name]=t===m?void 0:t}},ve=class extends N{constructor(){super(...arguments),this.type=4}j(t){this.element.toggleAttribute(this.name,!!t&&t!==m)}},ge=class extends N{constructor(t,e,s,r,o){super(t,e,s,r,o),this.type=5}_$AI(t,e=this){if((t=U(this,t,e,0)??m)===A)return;let s=this._$AH,r=t===m&&s!==m||t.capture!==s.capture||t.once!==s.once||t.passive!==s.passive,o=t!==m&&(s===m||r);r&&this.element.removeEventListener(this.name,this,s),o&&this.element.addEventListener(this.name,this,t),this._$AH=t}handleEvent(t){typeof this._$AH=="function"?this._$AH.call(this.options?.host??this.element,t):this._$AH.handleEvent(t)}},ye=class{constructor(t,e,s){this.element=t,this.type=6,this._$AN=void 0,this._$AM=e,this.options=s}get _$AU(){return this._$AM._$AU}_$AI(t){U(this,t)}},$t={M:Ne,P:C,A:Be,C:1,L:yt,R:ue,D:ft,V:U,I:z,H:N,N:ve,U:ge,B:fe,F:ye},as=Ue.litHtmlPolyfillSupport;as?.(ie,z),(Ue.litHtmlVersions??=[]).push("3.3.3");var bt=(i,t,e)=>{let s=e?.renderBefore??t,r=s._$litPart$;if(r===void 0){let o=e?.renderBefore??null;s._$litPart$=r=new z(t.insertBefore(se(),o),o,void 0,e??{})}return r._$AI(i),r};var We=globalThis,k=class extends T{constructor(){super(...arguments),this.renderOptions={host:this},this._$Do=void 0}createRenderRoot(){let t=super.createRenderRoot();return this.renderOptions.renderBefore??=t.firstChild,t}update(t){let e=this.render();this.hasUpdated||(this.renderOptions.isConnected=this.isConnected),super.update(t),this._$Do=bt(e,this.renderRoot,this.renderOptions)}connectedCallback(){super.connectedCallback(),this._$Do?.setConnected(!0)}disconnectedCallback(){super.disconnectedCallback(),this._$Do?.setConnected(!1)}render(){return A}};k._$litElement$=!0,k.finalized=!0,We.litElementHydrateSupport?.({LitElement:k});var ls=We.litElementPolyfillSupport;ls?.({LitElement:k});(We.litElementVersions??=[]).push("4.2.2");var cs={attribute:!0,type:String,converter:ee,reflect:!1,hasChanged:de},hs=(i=cs,t,e)=>{let{kind:s,metadata:r}=e,o=globalThis.litPropertyMetadata.get(r);if(o===void 0&&globalThis.litPropertyMetadata.set(r,o=new Map),s==="setter"&&((i=Object.create(i)).wrapped=!0),o.set(e.name,i),s==="accessor"){let{name:n}=e;return{set(a){let l=t.get.call(this);t.set.call(this,a),this.requestUpdate(n,l,i,!0,a)},init(a){return a!==void 0&&this.C(n,void 0,i,a),a}}}if(s==="setter"){let{name:n}=e;return function(a){let l=this[n];t.call(this,a),this.requestUpdate(n,l,i,!0,a)}}throw Error("Unsupported decorator location: "+s)};function x(i){return(t,e)=>typeof e=="object"?hs(i,t,e):((s,r,o)=>{let n=r.hasOwnProperty(o);return r.constructor.createProperty(o,s),n?Object.getOwnPropertyDescriptor(r,o):void 0})(i,t,e)}function y(i){return x({...i,state:!0,attribute:!1})}var M=(i,t,e)=>(e.configurable=!0,e.enumerable=!0,Reflect.decorate&&typeof t!="object"&&Object.defineProperty(i,t,e),e);function B(i,t){return(e,s,r)=>{let o=n=>n.renderRoot?.querySelector(i)??null;if(t){let{get:n,set:a}=typeof s=="object"?e:r??(()=>{let l=Symbol();return{get(){return this[l]},set(c){this[l]=c}}})();return M(e,s,{get(){let l=n.call(this);return l===void 0&&(l=o(this),(l!==null||this.hasUpdated)&&a.call(this,l)),l}})}return M(e,s,{get(){return o(this)}})}}var ps;function $e(i){return(t,e)=>M(t,e,{get(){return(this.renderRoot??(ps??=document.createDocumentFragment())).querySelectorAll(i)}})}function be(i){let t=i.n_verified===i.n_decisions;return p`<span class="badge ${t?"good":"bad"}">
    ${t?"verified":"not verified"}: ${i.n_verified} of ${i.n_decisions} decisions
  </span>`}function b(i,t){let e=Math.floor(i/t);return`${Math.floor(e/60)}:${String(e%60).padStart(2,"0")}`}function wt(i,t,e){let s=i.filter(r=>Math.sign(r-t)===e);if(s.length!==0)return e>0?Math.min(...s):Math.max(...s)}function _t(i,t){let e=-1;return i.forEach((s,r)=>{s.frame<=t&&(e=r)}),e}var xt=[.5,1,2,4,8],V=class{constructor(t,e,s){this.host=t;this.draw=e;this.isBusy=s;this.frame=0;this.isPlaying=!1;this.speed=1;this.lastTime=0;this.position=0;t.addController(this)}hostDisconnected(){this.isPlaying=!1}reset(t){this.frames=t,this.isPlaying=!1,this.host.requestUpdate()}seek(t){this.isPlaying=!1,this.show(t)}toggle(){this.frames&&(this.frame>=this.frames.last&&this.show(0),this.isPlaying=!this.isPlaying,this.lastTime=performance.now(),this.isPlaying&&requestAnimationFrame(t=>this.advance(t)),this.host.requestUpdate())}jump(t){let e=wt(this.frames?.events??[],this.frame,t);e!==void 0&&this.seek(e)}press(t){let e=t.composedPath()[0];if(t.ctrlKey||t.altKey||t.metaKey||e.matches("select, input"))return;let s=t.shiftKey?this.frames?.perSecond??30:1,o={" ":()=>this.toggle(),ArrowLeft:()=>this.seek(this.frame-s),ArrowRight:()=>this.seek(this.frame+s),"[":()=>this.jump(-1),"]":()=>this.jump(1),Home:()=>this.seek(0),End:()=>this.seek(this.frames?.last??0)}[t.key];!o||t.key===" "&&e.matches("button, summary")||(t.preventDefault(),o())}show(t){this.frames&&(this.frame=Math.max(0,Math.min(Math.round(t),this.frames.last)),this.position=this.frame,this.draw(this.frame),this.host.requestUpdate())}advance(t){if(!this.isPlaying||!this.frames)return;let e=Math.min(t-this.lastTime,250)/1e3;this.lastTime=t,this.position+=e*this.speed*this.frames.perSecond;let s=Math.min(Math.floor(this.position),this.frames.last);s!==this.frame&&!this.isBusy()&&(this.frame=s,this.draw(s)),this.frame>=this.frames.last?this.isPlaying=!1:requestAnimationFrame(r=>this.advance(r)),this.host.requestUpdate()}};var ds={previous:"M3 3h3v14H3z M17 3v14L7 10z",back:"M15 3v14L5 10z",play:"M5 3v14l12-7z",pause:"M4 3h4v14H4z M12 3h4v14h-4z",forward:"M5 3v14l10-7z",next:"M14 3h3v14h-3z M3 3v14l10-7z"};function we(i,t,e,s){let r=(c,d,h)=>p`<button type="button" aria-label=${c} title=${c} @click=${h}>
      <svg viewBox="0 0 20 20" aria-hidden="true">${w`<path d=${ds[d]}></path>`}</svg>
    </button>`,[o,n]=i.isPlaying?["Pause (space)","pause"]:["Play (space)","play"],{frame:a,speed:l}=i;return p`<div class="controls" role="group" aria-label="Playback">
    ${r("Previous event ([)","previous",()=>i.jump(-1))}
    ${r("Previous frame (left arrow)","back",()=>i.seek(a-1))}
    ${r(o,n,()=>i.toggle())}
    ${r("Next frame (right arrow)","forward",()=>i.seek(a+1))}
    ${r("Next event (])","next",()=>i.jump(1))}
    <label>
      Speed
      <select @change=${c=>i.speed=Number(c.target.value)}>
        ${xt.map(c=>p`<option value=${c} ?selected=${c===l}>${c}x</option>`)}
      </select>
    </label>
    <label class="seek">
      <span class="hidden">Frame</span>
      <input
        type="range"
        min="0"
        max=${t}
        .value=${String(a)}
        aria-valuetext="${b(a,e)} of ${b(t,e)}"
        @input=${c=>i.seek(Number(c.target.value))}
      />
    </label>
    <span class="time">${b(a,e)} / ${b(t,e)}, frame ${a}</span>
    <span class="time">${s}</span>
  </div>`}function Et(i,t){let e=(n,a)=>n.decisions.filter(l=>a.agents.some(c=>c.id===l.agent)),[s,r]=[e(i,t),e(t,i)],o=Math.max(s.length,r.length);for(let n=0;n<o;n++){let[a,l]=[s[n],r[n]];if(a&&l&&a.frame===l.frame&&a.agent===l.agent&&a.text===l.text)continue;return{frame:Math.min(a?.frame??1/0,l?.frame??1/0),decisions:[a,l]}}}function ze(i,t){return i.filter(e=>e.frame<=t).at(-1)?.done??0}function kt(i){return`M0 1${i.timeline.deliveries.map(({frame:e,done:s})=>`H${e}V${(1-s/i.total).toFixed(4)}`).join("")}H${i.last_frame}`}var L={view:512,map:720};function P(i,t){let s=(i?.clientWidth??0)*devicePixelRatio;return Math.min(Math.max(64*Math.ceil(s/64),64),t)}function F(i,{width:t,height:e,rgba:s}){let r=i?.getContext("2d");!i||!r||((i.width!==t||i.height!==e)&&(i.width=t,i.height=e),r.putImageData(new ImageData(s,t,e),0,0))}function _e(i,t){F(i,t);let e=i?.getContext("2d");if(e){e.lineJoin="round",e.lineWidth=2;for(let{text:s,at:r,font_px:o,width_px:n,align:a,color:l,border:c}of t.labels)e.font=`${o.toFixed(1)}px ui-monospace, Menlo, Consolas, monospace`,e.textAlign=a,c&&(e.strokeStyle=`rgb(${c.join(" ")})`,e.strokeText(s,...r,n)),e.fillStyle=`rgb(${l.join(" ")})`,e.fillText(s,...r,n)}}var K=class{constructor(t,e,s,r,o,n){this.wanted=s;this.onInfo=r;this.onFrame=o;this.onError=n;this.isBusy=!1;this.isOpen=!1;let a=URL.createObjectURL(new Blob([t],{type:"text/javascript"}));this.worker=new Worker(a),this.worker.onmessage=h=>this.receive(h.data),this.worker.onerror=h=>this.onError(h.message||"the worker has stopped"),URL.revokeObjectURL(a);let{module:l,trace:c,episode:d}=e;this.post({type:"open",module:l,trace:c,episode:d})}seek(t){this.next=t,this.drawNext()}rerun(t){this.onRerun=t;let e={type:"rerun"};this.worker.postMessage(e)}get isDrawing(){return this.isBusy}close(){this.worker.terminate()}post(t){this.isBusy=!0,this.worker.postMessage(t)}drawNext(){if(this.isBusy||this.next===void 0||!this.isOpen)return;let t=this.next;this.next=void 0,this.post({type:"frame",frame:t,...this.wanted()})}receive(t){if(t.type==="rerun"){this.onRerun?.(t.state);return}if(t.type==="verified"){this.onInfo(t.info);return}this.isBusy=!1,t.type==="opened"?(this.isOpen=!0,this.onInfo(t.info)):t.type==="frame"?this.onFrame(t):t.type==="error"&&this.onError(t.message),this.drawNext()}};var G=He`
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
  .detected {
    background: rgb(0 0 0 / 70%);
    border-left: 3px solid #fff;
    color: #fff;
    font-size: 0.6875rem;
    padding: 0 0.25rem;
    pointer-events: none;
    position: absolute;
    transform: translateY(-50%);
    white-space: nowrap;
  }
  .detected.before {
    border-left: 0;
    border-right: 3px solid #fff;
    transform: translate(-100%, -50%);
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
`;var xe={ATTRIBUTE:1,CHILD:2,PROPERTY:3,BOOLEAN_ATTRIBUTE:4,EVENT:5,ELEMENT:6},Ee=i=>(...t)=>({_$litDirective$:i,values:t}),X=class{constructor(t){}get _$AU(){return this._$AM._$AU}_$AT(t,e,s){this._$Ct=t,this._$AM=e,this._$Ci=s}_$AS(t,e){return this.update(t,e)}update(t,e){return this.render(...e)}};var St="important",ms=" !"+St,ne=Ee(class extends X{constructor(i){if(super(i),i.type!==xe.ATTRIBUTE||i.name!=="style"||i.strings?.length>2)throw Error("The `styleMap` directive must be used in the `style` attribute and must be the only part in the attribute.")}render(i){return Object.keys(i).reduce((t,e)=>{let s=i[e];return s==null?t:t+`${e=e.includes("-")?e:e.replace(/(?:^(webkit|moz|ms|o)|)(?=[A-Z])/g,"-$&").toLowerCase()}:${s};`},"")}update(i,[t]){let{style:e}=i.element;if(this.ft===void 0)return this.ft=new Set(Object.keys(t)),this.render(t);for(let s of this.ft)t[s]==null&&(this.ft.delete(s),s.includes("-")?e.removeProperty(s):e[s]=null);for(let s in t){let r=t[s];if(r!=null){this.ft.add(s);let o=typeof r=="string"&&r.endsWith(ms);s.includes("-")||o?e.setProperty(s,o?r.slice(0,-11):r,o?St:""):e[s]=r}}return A}});function ke(i,t,e,s=i.length){let{activities:r,deliveries:o}=i.timeline,n=c=>`${(100*c/Math.max(s,1)).toFixed(3)}%`,a=c=>{let d=c.currentTarget.getBoundingClientRect();e((c.clientX-d.left)/d.width*s)},l=c=>{let d=c.failed&&c.kind==="interact",h={left:n(c.start),width:n(c.end-c.start)},u=d?"failed":c.kind,f=d?p`<span class="mark" style=${ne({left:n(c.end)})}>×</span>`:"";return p`<span class="bar ${u}" style=${ne(h)}></span>${f}`};return p`<div class="timeline" aria-hidden="true">
    <div class="labels">
      <span>deliveries</span>
      ${i.agents.map(c=>p`<span>${c.name}</span>`)}
    </div>
    <div
      class="rows"
      @pointerdown=${a}
      @pointermove=${c=>c.buttons===1&&a(c)}
    >
      <div class="row">
        ${o.map(({frame:c,by:d})=>p`<span class="mark a${d}" style=${ne({left:n(c)})}>▼</span>`)}
      </div>
      ${i.agents.map(({id:c})=>p`<div class="row a${c}">
          ${r.filter(d=>d.agent===c).map(l)}
        </div>`)}
      <span class="now" style=${ne({left:n(t)})}></span>
    </div>
  </div>`}var Y=class{constructor(t,e){this.host=t;this.onChange=e;this.width=0;this.observer=new ResizeObserver(()=>{this.host.clientWidth!==this.width&&(this.width=this.host.clientWidth,this.onChange())});t.addController(this)}hostConnected(){this.observer.observe(this.host)}hostDisconnected(){this.observer.disconnect()}};var At=0,oe=1,S=class extends k{constructor(){super();this.workerSource="";this.start=0;this.infos=[];this.shown=[];this.viewer=oe;this.players=[];this.playback=new V(this,e=>this.moved(e),()=>this.players.length===0||this.players.some(e=>e.isDrawing));new Y(this,()=>this.redraw())}static{this.styles=G}disconnectedCallback(){super.disconnectedCallback(),this.close()}updated(e){e.has("sources")&&(this.close(),this.sources?.forEach((s,r)=>this.open(r,s)))}seek(e){this.playback.seek(e)}get frame(){return this.playback.frame}close(){this.players.forEach(e=>e.close()),this.players=[],this.infos=[],this.shown=[],this.problem=void 0,this.playback.reset()}open(e,s){let r=l=>{if(!l.is_complete)return;this.infos=Rt(this.infos,e,l);let[c,d]=this.infos;c&&d&&this.begin(c,d)},o=()=>({agents:[this.viewer],viewPx:P(this.viewCanvases[0],L.view),mapPx:e===0?P(this.mapCanvas,L.map):0,memories:[],withLimits:!1}),n=({state:l,views:c,map:d})=>{this.shown=Rt(this.shown,e,l),c[0]&&F(this.viewCanvases[e],c[0]),d&&_e(this.mapCanvas,d)},a=l=>{this.problem=l};this.players[e]=new K(this.workerSource,s,o,r,n,a)}begin(e,s){if(e.episode!==s.episode||e.seed!==s.seed){this.problem="the runs are not of the same episode and seed";return}let r=[e,s].every(a=>a.agents.some(l=>l.id===oe&&a.helper!=="none"));this.viewer=r?oe:At;let o=[e,s].flatMap(a=>a.timeline.story.map(l=>l.frame)).sort((a,l)=>a-l),n=Math.max(e.last_frame,s.last_frame);this.playback.reset({last:n,perSecond:e.frames_per_second,events:o}),this.updateComplete.then(()=>this.seek(this.start))}moved(e){this.players.forEach(s=>s.seek(e)),this.dispatchEvent(new CustomEvent("moved",{detail:e}))}redraw(){!this.infos[0]||!this.infos[1]||this.players.forEach(e=>e.seek(this.frame))}render(){let[e,s]=this.infos;if(this.problem||!e||!s)return p`<p role="status">${this.problem?`Cannot compare: ${this.problem}`:"Replaying ..."}</p>`;let r=[e,s],o=Math.max(e.last_frame,s.last_frame);return p`<section aria-label="Comparison" @keydown=${n=>this.playback.press(n)}>
      ${this.heading(r)} ${this.pictures(r)}
      ${we(this.playback,o,e.frames_per_second,this.status(r))}
      ${fs(r,o,this.frame,n=>this.seek(n))}
      ${r.map(n=>p`<h3>${_(n)}</h3>
          ${ke(n,this.frame,a=>this.seek(a),o)}`)}
      <div class="columns">${r.map(n=>this.story(n))}</div>
    </section>`}heading(e){let[s,r]=e,o=n=>p`<p>
        <b>${_(n)}</b>: ${ze(n.timeline.deliveries,n.last_frame)} of ${n.total} delivered.
        ${be(n)}
        ${n.problem?p`<span class="problem" role="alert">
              Shown up to frame ${n.last_frame} of ${n.length}: ${n.problem}
            </span>`:m}
      </p>`;return p`<header>
      <h2>${s.task}: ${_(s)} and ${_(r)}</h2>
      ${e.map(o)} ${this.difference(e)}
      <p class="small">${s.episode}, seed ${s.seed}, chaic ${s.chaic}</p>
    </header>`}difference(e){let[s,r]=e,o=Et(s,r);if(!o)return p`<p>Both runs are equal.</p>`;let n=s.agents.map(d=>d.name),a=d=>d?`the ${n[d.agent]??"agent"} ${d.text} (frame ${d.frame})`:"no more decisions",[l,c]=o.decisions;return p`<p>
      First different decision:
      <button type="button" class="link" @click=${()=>this.seek(o.frame)}>
        ${b(o.frame,s.frames_per_second)}
      </button>
      <br />${_(s)}: ${a(l)}; ${_(r)}: ${a(c)}
    </p>`}pictures(e){let s=e[0].agents.filter(n=>n.id<=oe&&e[1].agents.some(({id:a})=>a===n.id)),r=n=>{this.viewer=Number(n.target.value),this.redraw()},o=e.map((n,a)=>{let l=this.shown[a]?.captions[this.viewer];return p`<figure class="run${a}">
        <canvas class="view" width="384" height="384" role="img" aria-label="View with ${_(n)}"></canvas>
        <figcaption>
          <b>${_(n)}</b>${l?p`: ${l.action}<br />Plan: ${l.plan||"none"}`:m}
        </figcaption>
      </figure>`});return p`<p>
        <label>
          Views of the
          <select @change=${r}>
            ${s.map(n=>p`<option value=${n.id} ?selected=${n.id===this.viewer}>${n.name}</option>`)}
          </select>
        </label>
      </p>
      <div class="pictures">
        ${o}
        <figure>
          <div class="overlaid">
            <canvas class="map" width="480" height="480" role="img" aria-label="Map with the trails of both runs"></canvas>
            ${us(e,this.frame)}
          </div>
          <figcaption>Trails so far: solid with ${_(e[0])}, dashed with ${_(e[1])}; objects as with ${_(e[0])}</figcaption>
        </figure>
      </div>`}status(e){let s=e.map(r=>ze(r.timeline.deliveries,this.frame));return`${s[0]} and ${s[1]} of ${e[0].total} delivered`}story(e){return p`<div class="story">
      <h3>Events: ${_(e)}</h3>
      <ol>
        ${e.timeline.story.map(s=>p`<li>
            <button type="button" @click=${()=>this.seek(s.frame)}>
              <span class="time">${b(s.frame,e.frames_per_second)}</span> ${s.text}
            </button>
          </li>`)}
      </ol>
    </div>`}};v([x({attribute:!1})],S.prototype,"sources",2),v([x({attribute:!1})],S.prototype,"workerSource",2),v([x({type:Number})],S.prototype,"start",2),v([y()],S.prototype,"infos",2),v([y()],S.prototype,"shown",2),v([y()],S.prototype,"problem",2),v([y()],S.prototype,"viewer",2),v([$e("canvas.view")],S.prototype,"viewCanvases",2),v([B("canvas.map")],S.prototype,"mapCanvas",2);function _(i){return i.helper==="none"?"no helper":i.helper}function Rt(i,t,e){let s=[...i];return s[t]=e,s}function us(i,t){let e=(s,r,o)=>{let n=(s.trails[o]??[]).slice(0,1+Math.floor(t/s.trail_interval));if(n.length===0)return m;let[a,l]=n.at(-1);return w`<polyline class="a${o} run${r}" points=${n.join(" ")}></polyline>
      <circle class="a${o} run${r}" cx=${a} cy=${l} r="0.012"></circle>`};return p`<svg class="trails" viewBox="0 0 1 4" preserveAspectRatio="xMidYMin slice" aria-hidden="true">
    ${i.flatMap((s,r)=>[At,oe].map(o=>e(s,r,o)))}
  </svg>`}function fs(i,t,e,s){let r=o=>{let n=o.currentTarget.getBoundingClientRect();s((o.clientX-n.left)/n.width*t)};return p`<h3>Delivered over time</h3>
    <svg class="chart" viewBox="0 -0.05 ${Math.max(t,1)} 1.1" preserveAspectRatio="none" aria-hidden="true" @pointerdown=${r}>
      ${i.map((o,n)=>w`<path class="run${n}" d=${kt(o)}></path>`)}
      ${w`<path class="now" d="M${e} -0.05V1.05"></path>`}
    </svg>
    <p class="legend">From none to all; solid: ${_(i[0])}, dashed: ${_(i[1])}</p>`}customElements.define("chaic-compare",S);async function Se(i){let t=Uint8Array.from(atob(i.textContent.trim()),s=>s.charCodeAt(0)),e=new Blob([t]).stream().pipeThrough(new DecompressionStream("deflate-raw"));return new Response(e).arrayBuffer()}var Ve=()=>Se(document.getElementById("chaic-module")),Re=()=>document.getElementById("chaic-worker").textContent;var{I:vs}=$t,Tt=i=>i;var Ct=()=>document.createComment(""),J=(i,t,e)=>{let s=i._$AA.parentNode,r=t===void 0?i._$AB:t._$AA;if(e===void 0){let o=s.insertBefore(Ct(),r),n=s.insertBefore(Ct(),r);e=new vs(o,n,i,i.options)}else{let o=e._$AB.nextSibling,n=e._$AM,a=n!==i;if(a){let l;e._$AQ?.(i),e._$AM=i,e._$AP!==void 0&&(l=i._$AU)!==n._$AU&&e._$AP(l)}if(o!==r||a){let l=e._$AA;for(;l!==o;){let c=Tt(l).nextSibling;Tt(s).insertBefore(l,r),l=c}}}return e},I=(i,t,e=i)=>(i._$AI(t,e),i),gs={},Mt=(i,t=gs)=>i._$AH=t,Lt=i=>i._$AH,Ae=i=>{i._$AR(),i._$AA.remove()};var Pt=(i,t,e)=>{let s=new Map;for(let r=t;r<=e;r++)s.set(i[r],r);return s},It=Ee(class extends X{constructor(i){if(super(i),i.type!==xe.CHILD)throw Error("repeat() can only be used in text expressions")}dt(i,t,e){let s;e===void 0?e=t:t!==void 0&&(s=t);let r=[],o=[],n=0;for(let a of i)r[n]=s?s(a,n):n,o[n]=e(a,n),n++;return{values:o,keys:r}}render(i,t,e){return this.dt(i,t,e).values}update(i,[t,e,s]){let r=Lt(i),{values:o,keys:n}=this.dt(t,e,s);if(!Array.isArray(r))return this.ut=n,o;let a=this.ut??=[],l=[],c,d,h=0,u=r.length-1,f=0,g=o.length-1;for(;h<=u&&f<=g;)if(r[h]===null)h++;else if(r[u]===null)u--;else if(a[h]===n[f])l[f]=I(r[h],o[f]),h++,f++;else if(a[u]===n[g])l[g]=I(r[u],o[g]),u--,g--;else if(a[h]===n[g])l[g]=I(r[h],o[g]),J(i,l[g+1],r[h]),h++,g--;else if(a[u]===n[f])l[f]=I(r[u],o[f]),J(i,r[h],r[u]),u--,f++;else if(c===void 0&&(c=Pt(n,f,g),d=Pt(a,h,u)),c.has(a[h]))if(c.has(a[u])){let $=d.get(n[f]),O=$!==void 0?r[$]:null;if(O===null){let W=J(i,r[h]);I(W,o[f]),l[f]=W}else l[f]=I(O,o[f]),J(i,r[h],O),r[$]=null;f++}else Ae(r[u]),u--;else Ae(r[h]),h++;for(;f<=g;){let $=J(i,l[g+1]);I($,o[f]),l[f++]=$}for(;h<=u;){let $=r[h++];$!==null&&Ae($)}return this.ut=n,Mt(i,l),A}});var ys=[1,1.5,2.5,4],$s=1.5,Te=class{constructor(t,e){this.host=t;this.choices=e;this.timer=0;this.isOn=!1;this.seconds=$s}stop(){this.set(!1)}controls(t){let e=r=>this.set(r.target.checked),s=r=>{this.seconds=Number(r.target.value),this.set(this.isOn)};return p`<label>
        <input type="checkbox" class="scan" .checked=${this.isOn} @change=${e} />
        ${t}
      </label>
      ${this.isOn?p`<label>
            Time for each choice
            <select @change=${s}>
              ${ys.map(r=>p`<option value=${r} ?selected=${r===this.seconds}>${r} s</option>`)}
            </select>
          </label>`:m}`}set(t){clearInterval(this.timer),this.isOn=t,this.timer=t?window.setInterval(()=>this.next(),1e3*this.seconds):0,this.host.requestUpdate()}next(){let t=document.activeElement;for(;t?.shadowRoot?.activeElement;)t=t.shadowRoot.activeElement;if(t?.matches("select"))return;let e=this.choices(),s=e.findIndex(r=>r===t);e[(s+1)%e.length]?.focus()}};var Ot=512,Ht=["none","rhp","oracle"],Dt=15,E=class extends k{constructor(){super(...arguments);this.workerSource="";this.story=[];this.references=new Map;this.pointing={kind:"pick_up",hand:"left"};this.isBusy=!1;this.isOver=!1;this.lastTime=0;this.elapsedFrames=0;this.scanner=new Te(this,()=>this.choices());this.recordedLength=0;this.recordedFrame=0;this.nTraceRequests=0}static{this.styles=G}disconnectedCallback(){super.disconnectedCallback(),this.close()}updated(e){e.has("game")&&this.game&&this.open(this.game)}close(){this.simulator?.close(),this.simulator=void 0,this.scanner.stop(),this.info=this.shown=this.problem=void 0,this.story=[],this.references=new Map,this.isOver=!1,this.recordedLength=this.recordedFrame=this.nTraceRequests=0}open(e){this.close();let s=l=>this.receive(l);this.simulator=e.startSimulator?.(s)??this.startWorker(s);let{module:r,episode:o,config:n,branch:a}=e;this.post({type:"play",module:r,episode:o,config:{...n,is_live:e.isLive},branch:a})}startWorker(e){let s=URL.createObjectURL(new Blob([this.workerSource],{type:"text/javascript"})),r=new Worker(s);return URL.revokeObjectURL(s),r.onmessage=o=>e(o.data),r.onerror=o=>this.fail(o.message||"the worker has stopped"),{post:o=>r.postMessage(o),close:()=>r.terminate()}}post(e){this.isBusy=!0,this.simulator?.post(e)}receive(e){switch(this.isBusy=!1,e.type){case"playing":this.info=e.info,this.updateComplete.then(()=>this.begin());break;case"live":this.show(e.state),F(this.canvas,e.view);break;case"trace":this.nTraceRequests-=1,this.game?.isStudy&&this.record(e.trace),this.isOver&&this.nTraceRequests===0&&this.finish(e.trace);break;case"reference":this.references=new Map(this.references).set(e.helper,e.rate),this.compareNext();break;case"over":this.isOver=!0,this.dispatchEvent(new CustomEvent("over",{detail:"ended"}));break;case"error":this.fail(e.message);break}}fail(e){this.problem=e,this.game?.isStudy&&this.dispatchEvent(new CustomEvent("over",{detail:"left"}))}begin(){this.lastTime=performance.now(),this.elapsedFrames=1,requestAnimationFrame(e=>this.advance(e))}advance(e){if(!this.simulator||this.problem||this.isOver)return;let s=(this.game?.speed??1)*(this.info?.frames_per_second??0);this.elapsedFrames+=Math.min(e-this.lastTime,250)/1e3*s,this.elapsedFrames=Math.min(this.elapsedFrames,Math.max(s,1)),this.lastTime=e;let r=this.shown?.status==="waiting"&&!this.input&&!this.game?.isLive,o=Math.floor(this.elapsedFrames);if(!this.isBusy&&o>0&&(!r||this.input)){this.elapsedFrames-=o;let n=P(this.canvas,L.view);this.post({type:"advance",frames:o,viewPx:n,input:this.input}),this.input&&(this.recordedFrame=-Dt),this.input=void 0}else r&&(this.elapsedFrames=Math.min(this.elapsedFrames,1));requestAnimationFrame(n=>this.advance(n))}show(e){let s=e.status==="waiting"&&this.shown?.status!=="waiting",r=s?[]:(this.shown?.plans??[]).filter(n=>e.plans.includes(n)),o=e.plans.filter(n=>!r.includes(n));this.shown={...e,plans:[...r,...o]},e.events.length>0&&(this.story=[...this.story,...e.events]),e.status==="ended"?this.stop():this.game?.isStudy&&(s||e.frame-this.recordedFrame>=Dt)&&(this.recordedFrame=e.frame,this.requestTrace()),s&&this.updateComplete.then(()=>this.focusChoices())}focusChoices(){let e=document.activeElement;if(e!==document.body&&e!==this)return;let s=this.shadowRoot?.activeElement;s&&!s.closest(".plans")||this.shadowRoot?.querySelector(".plans button")?.focus()}stop(){this.isOver||(this.isOver=!0,this.requestTrace())}requestTrace(){this.nTraceRequests+=1,this.post({type:"trace"})}record(e){let s=e.slice(this.recordedLength);this.recordedLength=e.length,s&&this.dispatchEvent(new CustomEvent("recorded",{detail:s}))}finish(e){let{episode:s,isStudy:r}=this.game;if(r){let o=this.shown?.status==="ended"?"ended":"stopped";this.dispatchEvent(new CustomEvent("over",{detail:o}));return}this.dispatchEvent(new CustomEvent("finished",{detail:{trace:e,episode:s}})),this.shown?.status==="ended"&&this.compareNext()}compareNext(){let e=Ht.find(s=>!this.references.has(s));e&&this.post({type:"reference",helper:e})}choose(e){let s=this.shown?.plans[e];this.shown?.status==="waiting"&&!this.isOver&&s!==void 0&&(this.input={plan:s})}act(e){this.shown?.status==="waiting"&&(this.input={action:e})}point(e){if(this.game?.config.level!=="steps")return;let s=e.currentTarget.getBoundingClientRect(),r=(c,d)=>Math.max(0,Math.min(Ot-1,Math.floor(c/d*Ot))),o={column:r(e.clientX-s.left,s.width),row:r(e.clientY-s.top,s.height)},{kind:n,hand:a}=this.pointing,l={pick_up:"object",put_on:"place",remove_obstacle:"obstacle"}[n];this.act({[n]:{[l]:{pixel:o},hand:a}})}press(e){let s=e.composedPath()[0];if(e.ctrlKey||e.altKey||e.metaKey||s.matches("select, input"))return;let r=this.game?.config.level==="steps",o=/^[1-9]$/.test(e.key)?Number(e.key)-1:void 0,a=r?{ArrowUp:"move_forward",ArrowLeft:"turn_left",ArrowRight:"turn_right",".":{wait:{frames:10}}}[e.key]:void 0;if(a)this.act(a);else if(!r&&o!==void 0)this.choose(o);else return;e.preventDefault()}choices(){return[...this.shadowRoot.querySelectorAll(".plans button, button.link, input.scan")]}render(){let{info:e,shown:s}=this;return this.problem?p`<p class="problem" role="alert">Cannot play: ${this.problem}</p>`:e?p`<section aria-label="Play" @keydown=${r=>this.press(r)}>
      ${this.heading(e)}
      <div class="columns">
        <figure class="a${this.game?.config.seat??0}">
          <canvas
            class="view"
            width="512"
            height="512"
            role="img"
            aria-label="What you see"
            @click=${r=>this.point(r)}
          ></canvas>
        </figure>
        <div>
          ${s?this.status(s):m}
          ${this.game?.config.level==="plans"?this.plans(s):this.steps(s)}
          ${this.isOver?m:p`<p><button type="button" class="link" @click=${()=>this.stop()}>Stop here</button></p>`}
          ${s?.status==="ended"&&!this.game?.isStudy?this.result(s):m} ${this.events()}
        </div>
      </div>
    </section>`:this.isOver?p``:p`<p role="status">Loading ...</p>`}heading(e){let s=this.game?.config.seat===1,[r,o]=e.reach_m.map(a=>a.toFixed(2)),n=s?"The partner wants something that you do not know. Find out and help.":`Your body: ${e.person}. You want ${e.goal.join(", ")}.`;return p`<header>
      <h2>${e.task}: you are the ${s?"helper":"partner"}</h2>
      <p>${n} You reach from ${r} to ${o} m and lift ${e.strength_kg.toFixed(0)} kg.</p>
      <p class="small">${e.episode?`${e.episode}. `:""}A simulation: real people differ from these bodies and views.</p>
    </header>`}time(e){return b(e,this.info?.frames_per_second??1)}status(e){let{action:s,plan:r}=e.caption,o=e.hands.map(a=>a??"nothing"),n=e.progress?`, ${e.progress[0]} of ${e.progress[1]} delivered`:"";return p`<p class="time">
        ${this.time(e.frame)} of ${this.time(e.horizon)}${n}
      </p>
      <p>Left hand: ${o[0]}; right hand: ${o[1]}</p>
      <p role="status">You: ${s}${r?` (${r})`:""}${e.failure?`; failed: ${e.failure}`:""}</p>
      <p role="status">${e.is_refused?"Your last choice was no longer possible. Choose again.":""}</p>`}plans(e){return p`<h3>What next?</h3>
      <ol class="plans">
        ${It(e?.plans??[],s=>s,(s,r)=>p`<li><button type="button" @click=${()=>this.choose(r)}>${s}</button></li>`)}
      </ol>
      ${e?.status==="running"?p`<p>Doing it ...</p>`:m}
      ${this.game?.isStudy?m:this.scanner.controls("Offer one plan after the other, for a single switch")}`}steps(e){let s=(n,a)=>p`<button type="button" @click=${()=>this.act(a)}>${n}</button>`,r=n=>{let[a,l]=n.target.value.split(" ");this.pointing={kind:a,hand:l}},o=[["pick_up left","picks up with the left hand"],["pick_up right","picks up with the right hand"],["put_on left","puts what the left hand holds there"],["put_on right","puts what the right hand holds there"],["remove_obstacle left","removes an obstacle"]];return p`<div class="controls" role="group" aria-label="Actions">
        ${s("Turn left (left arrow)","turn_left")} ${s("Walk (up arrow)","move_forward")}
        ${s("Turn right (right arrow)","turn_right")} ${s("Put into the container","put_in")}
        ${s("Wait (.)",{wait:{frames:10}})}
      </div>
      <label>
        A click on the picture
        <select @change=${r}>
          ${o.map(([n,a])=>p`<option value=${n}>${a}</option>`)}
        </select>
      </label>
      ${e?.status==="running"?p`<p>Acting ...</p>`:m}`}result(e){let[s,r]=e.progress??[0,0],o=r>0?s/r:0,n=l=>l===void 0?"...":`${(100*l).toFixed(0)} %`,a=this.game?.config.seat===1?"your help":"you as the partner";return p`<h3>Result</h3>
      <table>
        <caption>Delivered part of the goal, same episode and seed</caption>
        <tr><th scope="row">${a}</th><td class="number">${n(o)}</td></tr>
        ${Ht.map(l=>p`<tr>
            <th scope="row">simulated partner, ${l==="none"?"no helper":`helper ${l}`}</th>
            <td class="number">${n(this.references.get(l))}</td>
          </tr>`)}
      </table>`}events(){return p`<div class="story">
      <h3>Events</h3>
      <ol reversed>
        ${[...this.story].reverse().map(e=>p`<li><span class="time">${this.time(e.frame)}</span> ${e.text}</li>`)}
      </ol>
    </div>`}};v([x({attribute:!1})],E.prototype,"game",2),v([x({attribute:!1})],E.prototype,"workerSource",2),v([y()],E.prototype,"info",2),v([y()],E.prototype,"shown",2),v([y()],E.prototype,"story",2),v([y()],E.prototype,"problem",2),v([y()],E.prototype,"references",2),v([y()],E.prototype,"pointing",2),v([B("canvas")],E.prototype,"canvas",2),v([y()],E.prototype,"isOver",2);customElements.define("chaic-play",E);async function jt(i,t,e){let{workerSource:s,pace:r,...o}=t,n=document.createElement("chaic-play");Object.assign(n,{workerSource:s,game:{...o,...r}}),n.addEventListener("finished",a=>{let{detail:l}=a,c=document.createElement("a");c.href=URL.createObjectURL(new Blob([l.trace],{type:"application/jsonl"})),c.download="trace.jsonl",c.textContent="Download the trace";let d=document.createElement("button");d.type="button",d.textContent="Watch the replay",d.addEventListener("click",()=>e(l));let h=document.createElement("p");h.append(c," (chaic verify trace.jsonl checks it) ",d),i.append(h)}),i.replaceChildren(n)}var Ce=320,ae=210,q=46,Ke=40,bs=8,Ge=12,ws=[0,.1,.5,1,2,5,10,20,50,100,200,500],Me=.5,_s=2,le={too_high:{mark:"\u2191",text:"too high"},too_low:{mark:"\u2193",text:"too low"},too_heavy:{mark:"\u25A0",text:"too heavy"}};function Ut(i,t){let[e,s]=i.reach_m,r=1.1*Math.max(.5,...t.map(h=>h.mass_kg)),o=Me*Math.ceil(Math.max(_s,...t.map(h=>h.top_m))/Me),n=h=>q+(Ce-q-Ge)*Math.sqrt(Math.min(h/r,1)),a=h=>ae-Ke-(ae-Ke-bs)*Math.min(h/o,1),l=Array.from({length:o/Me+1},(h,u)=>u*Me),c=xs(ws.filter(h=>h<=r),n),d=({name:h,limits:u,top_m:f,mass_kg:g})=>{let $=[n(g),a(Math.max(f,0))],O=w`<title>${h}, top at ${f.toFixed(2)} m, ${g.toFixed(1)} kg</title>`;if(u.length===0)return w`<circle cx=${$[0]} cy=${$[1]} r="4">${O}</circle>`;let W=u.map(Xt=>le[Xt].mark).join("");return w`<text class="beyond" x=${$[0]} y=${$[1]+5} text-anchor="middle">${W}${O}</text>`};return p`<svg class="limits" viewBox="0 0 ${Ce} ${ae}" aria-hidden="true">
    ${w`<rect class="region" x=${q} y=${a(s)} width=${n(i.strength_kg)-q}
      height=${a(e)-a(s)}></rect>`}
    ${l.map(h=>w`<line x1=${q} x2=${Ce-Ge} y1=${a(h)} y2=${a(h)}></line>
        <text x=${q-6} y=${a(h)+4} text-anchor="end">${h.toFixed(1)} m</text>`)}
    ${c.map(h=>w`<text x=${n(h)} y=${ae-Ke+17} text-anchor="middle">${h}</text>`)}
    ${w`<text x=${(q+Ce-Ge)/2} y=${ae-5} text-anchor="middle">mass, kg</text>`}
    ${t.map(d)}
  </svg>`}function xs(i,t){return i.reduce((s,r)=>s.length>0&&t(r)-t(s.at(-1))<26?s:[...s,r],[])}var Nt=0,Le=1,Bt={memories:[],objects:[]},Je=["partner","helper"],Xe=["#b8341c","#0b6e72"],Ze="#fafaf8",Es="#1e2026",ks=[[30,32,38,150],[0,0,0,0],[0,0,0,0]],Ss=[[190,192,196,255],[250,250,248,255],[70,74,82,255]],Rs=[[208,64,40,70],[16,136,140,70]],Qe=500,Pe=class{constructor(t,e){this.host=t;this.onChange=e;this.shown=new Set(["truth","explored","objects","paths"]);this.data=Bt}reset(){this.data=Bt,this.rerun=void 0}get memories(){return[Nt,Le].filter(t=>this.shown.has(Je[t]))}get withLimits(){return this.shown.has("limits")}advanced(t,e){return this.rerun=t,this.host.requestUpdate(),this.memories.length>this.data.memories.length&&(t.frame>e||t.is_complete)}draw(t,e,s,r){this.data=r,this.host.requestUpdate();let o=t?.getContext("2d");if(!(!t||!o)){t.width=e.width,t.height=e.height,o.setTransform(e.width,0,0,e.width,0,0),this.shown.has("truth")||(o.fillStyle=Ze,o.fillRect(0,0,1,e.height/e.width)),o.beginPath(),o.rect(0,0,1,s),o.clip(),this.shown.has("explored")&&this.drawExplored(o,r.memories);for(let n of r.memories)this.shown.has("paths")&&Cs(o,n),this.shown.has("objects")&&Ms(o,n);for(let{at:n,limits:a}of r.objects)Ft(o,[n[0]+.012,n[1]],a.map(l=>le[l].mark).join(""),Es)}}drawExplored(t,e){let[s,r]=e;if(!s)return;let o=this.shown.has("truth"),n=o?ks:Ss,a=s.cells.length/s.n_columns,l=new ImageData(s.n_columns,a);s.cells.forEach((u,f)=>{let g=r?.cells[f]??0,$=o||Math.max(u,g)===1,W=r!==void 0&&u===0!=(g===0)&&$?Rs[u===0?r.agent:s.agent]:n[Math.max(u,g)];l.data.set(W,4*f)});let c=new OffscreenCanvas(s.n_columns,a);c.getContext("2d").putImageData(l,0,0),t.imageSmoothingEnabled=!1;let[d,h]=s.map_at;t.drawImage(c,d,h,s.n_columns*s.cell,a*s.cell)}choice(t){let e=(o,n)=>p`<label>
        <input type="checkbox" .checked=${this.shown.has(o)} @change=${()=>this.toggle(o)} />
        ${n}
      </label>`,s=t.agents.some(o=>o.id===Le),r=[e("explored","Explored area"),e("objects","Remembered objects"),e("paths","Planned paths")];return p`<fieldset class="layers">
      <legend>Layers of the map</legend>
      ${e("truth","Truth")} ${e("partner","What the partner knows")}
      ${s?e("helper","What the helper believes"):m} ${e("limits","Limits of the partner")}
      ${this.memories.length>0?r:m}
    </fieldset>`}toggle(t){this.shown.delete(t)||this.shown.add(t),this.onChange(),this.host.requestUpdate()}words(t){if(this.memories.length===0&&!this.withLimits)return m;let e=t.frames_per_second;return p`<details class="words" open>
      <summary>The layers in words</summary>
      ${this.memories.length>0?this.progress(e):m}
      ${this.memories.map(s=>{let r=this.data.memories.find(o=>o.agent===s);return r?Ts(r,e):m})}
      ${this.withLimits?this.limitsInWords(t):m}
    </details>`}progress(t){let{rerun:e}=this,s=p`<p class="small">
      Dark area: not seen. Circles: objects in the partner's memory; squares: in the helper's; dashed: not in view;
      filled: wanted with a probability of at least ${Qe/10} %. Diamonds: last known positions of people. Lines
      with a dot: planned paths, dashed for the helper.
    </p>`;if(!e?.is_complete){let r=e?.frame??0;return p`<p>The agents run again beside the replay, up to ${b(r,t)} so far.</p>
        ${s}`}return p`<p role="status">
        ${e.agents.filter(({agent:r})=>this.memories.includes(r)).map(As)}
      </p>
      ${s}`}limitsInWords({agents:t}){let e=t[Nt],[s,r]=e.reach_m.map(a=>a.toFixed(2)),{objects:o}=this.data,n=o.filter(a=>a.limits.length>0);return p`<p>
        <b>Limits</b>: the partner (${e.person}) reaches tops from ${s} to ${r} m and lifts
        ${e.strength_kg.toFixed(0)} kg.
      </p>
      ${Ut(e,o)}
      <p class="small">
        Objects of the task by mass and height of their tops. The region is what the partner can pick up; circles are in
        it.
      </p>
      <p>${n.length===0?"No object of the task is beyond these limits.":"Beyond these limits:"}</p>
      <ul>
        ${n.map(({name:a,limits:l,top_m:c,mass_kg:d})=>p`<li>
            ${l.map(h=>le[h].mark)} ${a}: ${l.map(h=>le[h].text).join(", ")}
            (top at ${c.toFixed(2)} m, ${d.toFixed(1)} kg)
          </li>`)}
      </ul>`}};function As({agent:i,is_available:t,n_equal:e,differs_at:s}){let r=Je[i];if(!t)return p`The ${r} cannot run in a page: a person, another process, or a network. Its memory is not shown. `;let o=s===null?"":` It differs at frame ${s}; nothing is shown from there on.`;return p`The ${r} runs again, and ${e} of its actions equal the recorded ones.${o} `}function Ts(i,t){let{agent:e,objects:s,people:r,path_m:o,plan:n,seen_m2:a,is_belief_equal:l}=i,c=s.filter(u=>(u.wanted??0)>=Qe),d=u=>u.length>0?u.join(", "):"none",h=r.map(([u,,f])=>`${u} at ${b(f,t)}`);return p`<p>
    <b>The ${Je[e]}</b>, at its decision in frame ${i.frame}: has seen ${a.toFixed(0)} m². Plan:
    ${n||"none"}${o>0?`, along a path of ${o.toFixed(1)} m`:""}. Last saw people: ${d(h)}.
    ${c.length>0?p`Probably wanted: ${d(c.map(u=>u.name))}.`:m}
    ${l===null?m:l?"Its belief equals the recorded one.":"Its belief differs from the recorded one."}
    <br />Remembers ${s.length} objects: ${d(s.map(u=>u.name))}.
  </p>`}function Ye(i,t,e=[]){i.setLineDash([]),i.strokeStyle=Ze,i.lineWidth=.007,i.stroke(),i.setLineDash(e),i.strokeStyle=t,i.lineWidth=.0045,i.stroke(),i.setLineDash([])}function Cs(i,{agent:t,path:e}){let s=e.at(-1);s&&(i.beginPath(),e.forEach(([r,o])=>i.lineTo(r,o)),Ye(i,Xe[t],t===Le?[.016,.009]:[]),i.beginPath(),i.arc(s[0],s[1],.009,0,2*Math.PI),i.fillStyle=Xe[t],i.fill())}function Ms(i,{agent:t,frame:e,objects:s,people:r}){let n=Xe[t];for(let{at:a,last_seen:l,wanted:c}of s){let[d,h]=a;i.beginPath(),t===Le?i.rect(d-.02/2,h-.02/2,.02,.02):i.arc(d,h,.02/2,0,2*Math.PI),(c??0)>=Qe&&(i.fillStyle=n,i.fill()),Ye(i,n,l===e?[]:[.006,.005])}for(let[a,[l,c]]of r){i.beginPath();for(let[d,h]of[[0,-.02],[.02,0],[0,.02],[-.02,0]])i.lineTo(l+d,c+h);i.closePath(),Ye(i,n),Ft(i,[l-.008,c],a.slice(0,1).toUpperCase(),n)}}function Ft(i,[t,e],s,r){let{a:o}=i.getTransform();i.save(),i.setTransform(1,0,0,1,0,0),i.font=`bold ${Math.max(11,.026*o).toFixed(0)}px sans-serif`,i.textBaseline="middle",i.lineJoin="round",i.lineWidth=.008*o,i.strokeStyle=Ze,i.strokeText(s,t*o,e*o),i.fillStyle=r,i.fillText(s,t*o,e*o),i.restore()}var Ls=5,R=class extends k{constructor(){super();this.workerSource="";this.start=0;this.layers=new Pe(this,()=>this.chooseLayers());this.isRerunning=!1;this.playback=new V(this,e=>this.moved(e),()=>this.player?.isDrawing??!0);new Y(this,()=>this.player?.seek(this.frame))}static{this.styles=G}disconnectedCallback(){super.disconnectedCallback(),this.player?.close(),this.player=void 0}updated(e){e.has("source")&&this.source&&this.open(this.source)}seek(e){this.playback.seek(e)}get frame(){return this.playback.frame}open(e){this.player?.close(),this.info=this.shown=this.problem=void 0,this.isRerunning=!1,this.layers.reset(),this.playback.reset();let s=a=>{if(this.info=a,!a.is_complete){this.updateComplete.then(()=>this.player?.seek(0));return}this.problem=a.problem??void 0;let l=a.timeline.story.map(c=>c.frame);this.playback.reset({last:a.last_frame,perSecond:a.frames_per_second,events:l}),this.updateComplete.then(()=>{this.seek(this.start),this.chooseLayers()})},r=a=>{this.problem=a},o=a=>this.draw(a),n=()=>({agents:et(this.info).map(a=>a.id),viewPx:P(this.viewCanvases[0],L.view),mapPx:P(this.mapCanvas,L.map),memories:this.layers.memories,withLimits:this.layers.withLimits});this.player=new K(this.workerSource,e,n,s,o,r)}moved(e){this.player?.seek(e),this.dispatchEvent(new CustomEvent("moved",{detail:e}))}draw({state:e,views:s,map:r,layers:o}){this.shown=e,s.forEach((n,a)=>F(this.viewCanvases[a],n)),!(!r||!this.info)&&(_e(this.mapCanvas,r),this.layers.draw(this.layerCanvas,r,this.info.map_height,o))}chooseLayers(){let{player:e,layers:s}=this;e?.seek(this.frame),!(!e||this.isRerunning||s.memories.length===0)&&(this.isRerunning=!0,e.rerun(r=>{s.advanced(r,this.frame)&&e.seek(this.frame)}))}render(){let{info:e}=this;return e?p`<section aria-label="Replay" @keydown=${s=>this.playback.press(s)}>
      ${this.heading(e)} ${this.pictures(e)}
      ${e.is_complete?this.details(e):p`<p role="status">Verifying ...</p>`}
    </section>`:p`<p role="status">${this.problem?`Cannot show this replay: ${this.problem}`:"Replaying ..."}</p>`}details(e){return p`${we(this.playback,e.last_frame,e.frames_per_second,this.status(e))}
      ${this.layers.choice(e)} ${this.layers.words(e)}
      ${ke(e,this.frame,s=>this.seek(s))} ${Is()} ${this.seats(e)}
      <div class="columns">${this.story(e)} ${this.belief(this.shown?.belief)}</div>`}heading(e){let s=e.agents[0],r=e.timeline.deliveries.at(-1)?.done??0,o=e.helper==="none"?"Nobody helps":`The helper ${e.helper} helps`;return p`<header>
      <h2>${e.task}: the partner (${s?.person??""}) wants ${e.goal.join(", ")}</h2>
      <p>
        ${o}${e.is_complete?`; ${r} of ${e.total} delivered`:""}. ${Ps(e)}
        ${e.is_complete?be(e):m}
      </p>
      ${this.problem?p`<p class="problem" role="alert">
            Shown up to frame ${e.last_frame} of ${e.length}: ${this.problem}
          </p>`:m}
      <p class="small">${e.episode}, helper ${e.helper}, seed ${e.seed}, chaic ${e.chaic}</p>
    </header>`}pictures(e){let s=n=>this.shown?.detected[n]??[],r=n=>{let a=this.shown?.captions[n];if(!a)return m;let l=a.last_observed?p`<br />Recognized: ${a.last_observed}`:m,c=s(n).map(h=>h.label),d=c.length>0?p`<br />Detects: ${c.join(", ")}`:m;return p`<b>${a.agent}</b>: ${a.action}<br />Plan: ${a.plan||"none"}${l}${d}`},o=({label:n,at:[a,l]})=>p`<span
        class="detected ${a>.75?"before":""}"
        style="left: ${100*a}%; top: clamp(0.5rem, ${100*l}%, 100% - 0.5rem)"
        >${n}</span
      >`;return p`<div class="pictures">
      ${et(e).map(n=>p`<figure class="a${n.id}">
          <div class="overlaid">
            <canvas class="view" width="384" height="384" role="img" aria-label="View of the ${n.name}"></canvas>
            <div aria-hidden="true">${s(n.id).map(o)}</div>
          </div>
          <figcaption>${r(n.id)}</figcaption>
        </figure>`)}
      <figure>
        <div class="overlaid">
          <canvas class="map" width="480" height="480" role="img" aria-label="Map of the place with both agents"></canvas>
          <canvas class="layers" aria-hidden="true"></canvas>
        </div>
        <figcaption>Map${this.shown?.belief?"; ring: believed position of the partner":""}</figcaption>
      </figure>
    </div>`}seats(e){let s=r=>{this.playback.seek(this.frame),this.dispatchEvent(new CustomEvent("take-over",{detail:{frame:this.frame,seat:r,seed:e.seed}}))};return this.problem?m:p`<p>
      Take over from here as the
      ${et(e).map(({id:r,name:o})=>p`<button type="button" class="link" @click=${()=>s(r)}>${o}</button> `)}
    </p>`}status(e){return`${this.shown?.done??0} of ${e.total} delivered`}story(e){let{story:s}=e.timeline,r=_t(s,this.frame);return p`<div class="story">
      <h3>Events</h3>
      ${s.length===0?p`<p>None.</p>`:m}
      <ol>
        ${s.map((o,n)=>p`<li>
            <button
              type="button"
              aria-current=${n===r?"step":"false"}
              @click=${()=>this.seek(o.frame)}
            >
              <span class="time">${b(o.frame,e.frames_per_second)}</span> ${o.text}
            </button>
          </li>`)}
      </ol>
    </div>`}belief(e){if(!e)return m;let s=(r,o)=>p`<table>
      <caption>${r}</caption>
      ${[...o].sort((n,a)=>a[1]-n[1]).slice(0,Ls).map(([n,a])=>p`<tr>
            <th scope="row">${n}</th>
            <td><meter min="0" max="1000" .value=${a} aria-label=${n}></meter></td>
            <td class="number">${Math.round(a/10)} %</td>
          </tr>`)}
    </table>`;return p`<div class="belief">
      <h3>What the helper believes</h3>
      ${s("Goal",e.goals)} ${s("Person",e.people)}
      ${e.evidence?.length?p`<p>Saw: ${e.evidence.at(-1)}</p>`:m}
    </div>`}};v([x({attribute:!1})],R.prototype,"source",2),v([x({attribute:!1})],R.prototype,"workerSource",2),v([x({type:Number})],R.prototype,"start",2),v([y()],R.prototype,"info",2),v([y()],R.prototype,"shown",2),v([y()],R.prototype,"problem",2),v([$e("canvas.view")],R.prototype,"viewCanvases",2),v([B("canvas.map")],R.prototype,"mapCanvas",2),v([B("canvas.layers")],R.prototype,"layerCanvas",2);function et(i){return i?.agents.filter(t=>t.id<2)??[]}function Ps(i){let t=i.agents[0];if(!t)return"";let[e,s]=t.reach_m.map(r=>r.toFixed(2));return`The partner reaches from ${e} to ${s} m and lifts ${t.strength_kg.toFixed(0)} kg.`}function Is(){return p`<p class="legend">
    <span class="key walk"></span> walks <span class="key interact"></span> uses its hands
    <span class="key failed"></span> in vain (×) <span class="key wait"></span> waits
    <span class="key triangle">▼</span> delivery
  </p>`}customElements.define("chaic-replay",R);function qt(i,t){let e=i.cells[t]?.textContent?.trim()??"",s=/^-?\d+(\.\d+)?/.exec(e);return s?Number(s[0]):e}function Os(i,t){return typeof i=="number"&&typeof t=="number"?i-t:typeof i==typeof t?String(i).localeCompare(String(t)):typeof i=="number"?-1:1}function Wt(i){let t=i.tBodies[0],e=[...i.tHead?.rows[0]?.cells??[]];if(t)for(let s of e.filter(r=>r.tagName==="TH")){let r=document.createElement("button");r.type="button",r.textContent=s.textContent,r.addEventListener("click",()=>{let o=s.ariaSort==="ascending";e.forEach(c=>c.ariaSort=null),s.ariaSort=o?"descending":"ascending";let n=o?-1:1,a=s.cellIndex,l=[...t.rows].sort((c,d)=>n*Os(qt(c,a),qt(d,a)));t.append(...l)}),s.replaceChildren(r)}}function zt(){let[,i,t,e]=/^#(\d+)(?:\+(\d+))?@(\d+)$/.exec(location.hash)??[];return{replay:Number(i??0),other:t===void 0?void 0:Number(t),frame:Number(e??0)}}var tt=new TextEncoder,st=class{constructor(t,e,s,r){this.contents=t;this.choice=e;this.other=s;this.player=r;this.pending=0;let o=(n,a)=>{this.show({replay:Number(e.value),other:a,frame:n})};e.addEventListener("change",()=>o(0)),s.addEventListener("change",()=>{o(this.element?.frame??0,s.value===""?void 0:Number(s.value))}),addEventListener("hashchange",()=>{this.show(zt()),e.scrollIntoView()})}async show(t){let e=[t.replay,t.other].filter(a=>a!==void 0).map(a=>this.contents[a]);if(!e.every(a=>a!==void 0)){this.contents.length>0&&await this.show({replay:0,frame:0});return}let s=this.isChosen(t);if(this.shown=t,s){this.element?.seek(t.frame);return}this.select(t);let[r,o]=await Promise.all(e.map(a=>this.source(a)));if(!this.isChosen(t))return;let n={workerSource:Re(),start:this.shown.frame};if(o){let a=document.createElement("chaic-compare");this.element=Object.assign(a,{sources:[r,o],...n})}else this.element=Vt(r,this.shown.frame);this.element.addEventListener("moved",a=>this.moved(a.detail)),this.player.replaceChildren(this.element)}showOther(t){clearTimeout(this.pending),this.shown=void 0,this.element=void 0,this.choice.selectedIndex=-1,this.other.replaceChildren(),this.other.disabled=!0,this.player.replaceChildren(t)}isChosen({replay:t,other:e}){return this.shown?.replay===t&&this.shown.other===e}async source(t){let{trace:e,episode:s}=JSON.parse(new TextDecoder().decode(await Se(t)));return{module:await Ve(),trace:tt.encode(e),episode:tt.encode(s)}}select({replay:t,other:e}){this.choice.value=String(t);let s=[...this.choice.options],r=s[t]?.dataset.place,o=s.filter((n,a)=>a!==t&&n.dataset.place===r);this.other.replaceChildren(new Option("nothing",""),...o.map(n=>new Option(n.text,n.value))),this.other.value=e===void 0?"":String(e),this.other.disabled=o.length===0}moved(t){clearTimeout(this.pending);let{replay:e,other:s}=this.shown,r=s===void 0?e:`${e}+${s}`;this.pending=window.setTimeout(()=>{location.protocol!=="about:"&&history.replaceState(null,"",`#${r}@${t}`)},300)}},Ie;function Vt(i,t){let e=document.createElement("chaic-replay");return e.addEventListener("take-over",s=>{let{frame:r,seat:o,seed:n}=s.detail,a={seed:n,seat:o,level:"plans",helper:"none"};Kt(i.episode,a,{isLive:!1,speed:1},{trace:i.trace,frame:r})}),Object.assign(e,{source:i,workerSource:Re(),start:t})}async function Kt(i,t,e,s){let r=document.getElementById("play"),o=await Ve(),n=({trace:a})=>{let l=Vt({module:o,trace:tt.encode(a),episode:i},0);Ie?Ie.showOther(l):document.getElementById("player").replaceChildren(l),l.scrollIntoView()};await jt(r,{module:o,workerSource:Re(),episode:i,config:t,pace:e,branch:s},n),r.scrollIntoView()}function Hs(i){let t=[...document.querySelectorAll("script.chaic-episode")];i.addEventListener("submit",e=>{e.preventDefault();let s=new FormData(i),r=c=>String(s.get(c)),o=t[Number(r("episode"))];if(!o)return;let n=r("level"),a={seed:0,seat:Number(r("seat")),level:n,helper:r("helper")},l={isLive:r("pace")==="live",speed:Number(r("speed"))};Se(o).then(c=>Kt(new Uint8Array(c),a,l))})}async function Ds(){let i=document.querySelector("#game");i&&Hs(i),document.querySelectorAll("table.sortable").forEach(Wt);let t=[...document.querySelectorAll("script.chaic-replay")],e=document.querySelector("#choice"),s=document.querySelector("#other"),r=document.querySelector("#player");!e||!s||!r||(Ie=new st(t,e,s,r),await Ie.show(zt()))}function Gt(i){let t=document.querySelector("[data-status]");t&&(t.textContent=`Cannot show the replays: ${String(i)}`)}addEventListener("unhandledrejection",i=>Gt(i.reason));Ds().catch(Gt);})();
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
lit-html/directives/repeat.js:
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
  (**
   * @license
   * Copyright 2021 Google LLC
   * SPDX-License-Identifier: BSD-3-Clause
   *)

lit-html/directives/style-map.js:
  (**
   * @license
   * Copyright 2018 Google LLC
   * SPDX-License-Identifier: BSD-3-Clause
   *)

lit-html/directive-helpers.js:
  (**
   * @license
   * Copyright 2020 Google LLC
   * SPDX-License-Identifier: BSD-3-Clause
   *)
*/
