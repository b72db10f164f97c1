"use strict";(()=>{var os=Object.defineProperty;var as=Object.getOwnPropertyDescriptor;var v=(i,t,e,s)=>{for(var r=s>1?void 0:s?as(t,e):t,n=i.length-1,o;n>=0;n--)(o=i[n])&&(r=(s?o(t,e,r):o(r))||r);return s&&r&&os(t,e,r),r};var de=globalThis,me=de.ShadowRoot&&(de.ShadyCSS===void 0||de.ShadyCSS.nativeShadow)&&"adoptedStyleSheets"in Document.prototype&&"replace"in CSSStyleSheet.prototype,Ne=Symbol(),ht=new WeakMap,ee=class{constructor(t,e,s){if(this._$cssResult$=!0,s!==Ne)throw Error("CSSResult is not constructable. Use `unsafeCSS` or `css` instead.");this.cssText=t,this.t=e}get styleSheet(){let t=this.o,e=this.t;if(me&&t===void 0){let s=e!==void 0&&e.length===1;s&&(t=ht.get(e)),t===void 0&&((this.o=t=new CSSStyleSheet).replaceSync(this.cssText),s&&ht.set(e,t))}return t}toString(){return this.cssText}},pt=i=>new ee(typeof i=="string"?i:i+"",void 0,Ne),Ue=(i,...t)=>{let e=i.length===1?i[0]:t.reduce((s,r,n)=>s+(o=>{if(o._$cssResult$===!0)return o.cssText;if(typeof o=="number")return o;throw Error("Value passed to 'css' function must be a 'css' function result: "+o+". Use 'unsafeCSS' to pass non-literal values, but take care to ensure page security.")})(r)+i[n+1],i[0]);return new ee(e,i,Ne)},dt=(i,t)=>{if(me)i.adoptedStyleSheets=t.map(e=>e instanceof CSSStyleSheet?e:e.styleSheet);else for(let e of t){let s=document.createElement("style"),r=de.litNonce;r!==void 0&&s.setAttribute("nonce",r),s.textContent=e.cssText,i.appendChild(s)}},qe=me?i=>i:i=>i instanceof CSSStyleSheet?(t=>{let e="";for(let s of t.cssRules)e+=s.cssText;return pt(e)})(i):i;var{is:ls,defineProperty:cs,getOwnPropertyDescriptor:hs,getOwnPropertyNames:ps,getOwnPropertySymbols:ds,getPrototypeOf:ms}=Object,ue=globalThis,mt=ue.trustedTypes,us=mt?mt.emptyScript:"",fs=ue.reactiveElementPolyfillSupport,te=(i,t)=>i,se={toAttribute(i,t){switch(t){case Boolean:i=i?us:null;break;case Object:case Array:i=i==null?i:JSON.stringify(i)}return i},fromAttribute(i,t){let e=i;switch(t){case Boolean:e=i!==null;break;case Number:e=i===null?null:Number(i);break;case Object:case Array:try{e=JSON.parse(i)}catch{e=null}}return e}},fe=(i,t)=>!ls(i,t),ut={attribute:!0,type:String,converter:se,reflect:!1,useDefault:!1,hasChanged:fe};Symbol.metadata??=Symbol("metadata"),ue.litPropertyMetadata??=new WeakMap;var T=class extends HTMLElement{static addInitializer(t){this._$Ei(),(this.l??=[]).push(t)}static get observedAttributes(){return this.finalize(),this._$Eh&&[...this._$Eh.keys()]}static createProperty(t,e=ut){if(e.state&&(e.attribute=!1),this._$Ei(),this.prototype.hasOwnProperty(t)&&((e=Object.create(e)).wrapped=!0),this.elementProperties.set(t,e),!e.noAccessor){let s=Symbol(),r=this.getPropertyDescriptor(t,s,e);r!==void 0&&cs(this.prototype,t,r)}}static getPropertyDescriptor(t,e,s){let{get:r,set:n}=hs(this.prototype,t)??{get(){return this[e]},set(o){this[e]=o}};return{get:r,set(o){let a=r?.call(this);n?.call(this,o),this.requestUpdate(t,a,s)},configurable:!0,enumerable:!0}}static getPropertyOptions(t){return this.elementProperties.get(t)??ut}static _$Ei(){if(this.hasOwnProperty(te("elementProperties")))return;let t=ms(this);t.finalize(),t.l!==void 0&&(this.l=[...t.l]),this.elementProperties=new Map(t.elementProperties)}static finalize(){if(this.hasOwnProperty(te("finalized")))return;if(this.finalized=!0,this._$Ei(),this.hasOwnProperty(te("properties"))){let e=this.properties,s=[...ps(e),...ds(e)];for(let r of s)this.createProperty(r,e[r])}let t=this[Symbol.metadata];if(t!==null){let e=litPropertyMetadata.get(t);if(e!==void 0)for(let[s,r]of e)this.elementProperties.set(s,r)}this._$Eh=new Map;for(let[e,s]of this.elementProperties){let r=this._$Eu(e,s);r!==void 0&&this._$Eh.set(r,e)}this.elementStyles=this.finalizeStyles(this.styles)}static finalizeStyles(t){let e=[];if(Array.isArray(t)){let s=new Set(t.flat(1/0).reverse());for(let r of s)e.unshift(qe(r))}else t!==void 0&&e.push(qe(t));return e}static _$Eu(t,e){let s=e.attribute;return s===!1?void 0:typeof s=="string"?s:typeof t=="string"?t.toLowerCase():void 0}constructor(){super(),this._$Ep=void 0,this.isUpdatePending=!1,this.hasUpdated=!1,this._$Em=null,this._$Ev()}_$Ev(){this._$ES=new Promise(t=>this.enableUpdating=t),this._$AL=new Map,this._$E_(),this.requestUpdate(),this.constructor.l?.forEach(t=>t(this))}addController(t){(this._$EO??=new Set).add(t),this.renderRoot!==void 0&&this.isConnected&&t.hostConnected?.()}removeController(t){this._$EO?.delete(t)}_$E_(){let t=new Map,e=this.constructor.elementProperties;for(let s of e.keys())this.hasOwnProperty(s)&&(t.set(s,this[s]),delete this[s]);t.size>0&&(this._$Ep=t)}createRenderRoot(){let t=this.shadowRoot??this.attachShadow(this.constructor.shadowRootOptions);return dt(t,this.constructor.elementStyles),t}connectedCallback(){this.renderRoot??=this.createRenderRoot(),this.enableUpdating(!0),this._$EO?.forEach(t=>t.hostConnected?.())}enableUpdating(t){}disconnectedCallback(){this._$EO?.forEach(t=>t.hostDisconnected?.())}attributeChangedCallback(t,e,s){this._$AK(t,s)}_$ET(t,e){let s=this.constructor.elementProperties.get(t),r=this.constructor._$Eu(t,s);if(r!==void 0&&s.reflect===!0){let n=(s.converter?.toAttribute!==void 0?s.converter:se).toAttribute(e,s.type);this._$Em=t,n==null?this.removeAttribute(r):this.setAttribute(r,n),this._$Em=null}}_$AK(t,e){let s=this.constructor,r=s._$Eh.get(t);if(r!==void 0&&this._$Em!==r){let n=s.getPropertyOptions(r),o=typeof n.converter=="function"?{fromAttribute:n.converter}:n.converter?.fromAttribute!==void 0?n.converter:se;this._$Em=r;let a=o.fromAttribute(e,n.type);this[r]=a??this._$Ej?.get(r)??a,this._$Em=null}}requestUpdate(t,e,s,r=!1,n){if(t!==void 0){let o=this.constructor;if(r===!1&&(n=this[t]),s??=o.getPropertyOptions(t),!((s.hasChanged??fe)(n,e)||s.useDefault&&s.reflect&&n===this._$Ej?.get(t)&&!this.hasAttribute(o._$Eu(t,s))))return;this.C(t,e,s)}this.isUpdatePending===!1&&(this._$ES=this._$EP())}C(t,e,{useDefault:s,reflect:r,wrapped:n},o){s&&!(this._$Ej??=new Map).has(t)&&(this._$Ej.set(t,o??e??this[t]),n!==!0||o!==void 0)||(this._$AL.has(t)||(this.hasUpdated||s||(e=void 0),this._$AL.set(t,e)),r===!0&&this._$Em!==t&&(this._$Eq??=new Set).add(t))}async _$EP(){this.isUpdatePending=!0;try{await this._$ES}catch(e){Promise.reject(e)}let t=this.scheduleUpdate();return t!=null&&await t,!this.isUpdatePending}scheduleUpdate(){return this.performUpdate()}performUpdate(){if(!this.isUpdatePending)return;if(!this.hasUpdated){if(this.renderRoot??=this.createRenderRoot(),this._$Ep){for(let[r,n]of this._$Ep)this[r]=n;this._$Ep=void 0}let s=this.constructor.elementProperties;if(s.size>0)for(let[r,n]of s){let{wrapped:o}=n,a=this[r];o!==!0||this._$AL.has(r)||a===void 0||this.C(r,void 0,n,a)}}let t=!1,e=this._$AL;try{t=this.shouldUpdate(e),t?(this.willUpdate(e),this._$EO?.forEach(s=>s.hostUpdate?.()),this.update(e)):this._$EM()}catch(s){throw t=!1,this._$EM(),s}t&&this._$AE(e)}willUpdate(t){}_$AE(t){this._$EO?.forEach(e=>e.hostUpdated?.()),this.hasUpdated||(this.hasUpdated=!0,this.firstUpdated(t)),this.updated(t)}_$EM(){this._$AL=new Map,this.isUpdatePending=!1}get updateComplete(){return this.getUpdateComplete()}getUpdateComplete(){return this._$ES}shouldUpdate(t){return!0}update(t){this._$Eq&&=this._$Eq.forEach(e=>this._$ET(e,this[e])),this._$EM()}updated(t){}firstUpdated(t){}};T.elementStyles=[],T.shadowRootOptions={mode:"open"},T[te("elementProperties")]=new Map,T[te("finalized")]=new Map,fs?.({ReactiveElement:T}),(ue.reactiveElementVersions??=[]).push("2.1.2");var Fe=globalThis,ft=i=>i,ve=Fe.trustedTypes,vt=ve?ve.createPolicy("lit-html",{createHTML:i=>i}):void 0,We="$lit$",C=`lit$${Math.random().toFixed(9).slice(2)}$`,ze="?"+C,vs=`<${ze}>`,U=document,ie=()=>U.createComment(""),ne=i=>i===null||typeof i!="object"&&typeof i!="function",Ve=Array.isArray,_t=i=>Ve(i)||typeof i?.[Symbol.iterator]=="function",Be=`[ 	
\f\r]`,re=/<(?:(!--|\/[^a-zA-Z])|(\/?[a-zA-Z][^>\s]*)|(\/?$))/g,gt=/-->/g,yt=/>/g,j=RegExp(`>|${Be}(?:([^\\s"'>=/]+)(${Be}*=${Be}*(?:[^ 	
\f\r"'\`<>=]|("|')|))|$)`,"g"),$t=/'/g,bt=/"/g,xt=/^(?:script|style|textarea|title)$/i,Ke=i=>(t,...e)=>({_$litType$:i,strings:t,values:e}),p=Ke(1),w=Ke(2),tr=Ke(3),A=Symbol.for("lit-noChange"),u=Symbol.for("lit-nothing"),wt=new WeakMap,N=U.createTreeWalker(U,129);function Et(i,t){if(!Ve(i)||!i.hasOwnProperty("raw"))throw Error("invalid template strings array");return vt!==void 0?vt.createHTML(t):t}var kt=(i,t)=>{let e=i.length-1,s=[],r,n=t===2?"<svg>":t===3?"<math>":"",o=re;for(let a=0;a<e;a++){let l=i[a],c,d,h=-1,m=0;for(;m<l.length&&(o.lastIndex=m,d=o.exec(l),d!==null);)m=o.lastIndex,o===re?d[1]==="!--"?o=gt:d[1]!==void 0?o=yt:d[2]!==void 0?(xt.test(d[2])&&(r=RegExp("</"+d[2],"g")),o=j):d[3]!==void 0&&(o=j):o===j?d[0]===">"?(o=r??re,h=-1):d[1]===void 0?h=-2:(h=o.lastIndex-d[2].length,c=d[1],o=d[3]===void 0?j:d[3]==='"'?bt:$t):o===bt||o===$t?o=j:o===gt||o===yt?o=re:(o=j,r=void 0);let f=o===j&&i[a+1].startsWith("/>")?" ":"";n+=o===re?l+vs:h>=0?(s.push(c),l.slice(0,h)+We+l.slice(h)+C+f):l+C+(h===-2?a:f)}return[Et(i,n+(i[e]||"<?>")+(t===2?"</svg>":t===3?"</math>":"")),s]},oe=class i{constructor({strings:t,_$litType$:e},s){let r;this.parts=[];let n=0,o=0,a=t.length-1,l=this.parts,[c,d]=kt(t,e);if(this.el=i.createElement(c,s),N.currentNode=this.el.content,e===2||e===3){let h=this.el.content.firstChild;h.replaceWith(...h.childNodes)}for(;(r=N.nextNode())!==null&&l.length<a;){if(r.nodeType===1){if(r.hasAttributes())for(let h of r.getAttributeNames())if(h.endsWith(We)){let m=d[o++],f=r.getAttribute(h).split(C),g=/([.?@])?(.*)/.exec(m);l.push({type:1,index:n,name:g[2],strings:f,ctor:g[1]==="."?ye:g[1]==="?"?$e:g[1]==="@"?be:B}),r.removeAttribute(h)}else h.startsWith(C)&&(l.push({type:6,index:n}),r.removeAttribute(h));if(xt.test(r.tagName)){let h=r.textContent.split(C),m=h.length-1;if(m>0){r.textContent=ve?ve.emptyScript:"";for(let f=0;f<m;f++)r.append(h[f],ie()),N.nextNode(),l.push({type:2,index:++n});r.append(h[m],ie())}}}else if(r.nodeType===8)if(r.data===ze)l.push({type:2,index:n});else{let h=-1;for(;(h=r.data.indexOf(C,h+1))!==-1;)l.push({type:7,index:n}),h+=C.length-1}n++}}static createElement(t,e){let s=U.createElement("template");return s.innerHTML=t,s}};function q(i,t,e=i,s){if(t===A)return t;let r=s!==void 0?e._$Co?.[s]:e._$Cl,n=ne(t)?void 0:t._$litDirective$;return r?.constructor!==n&&(r?._$AO?.(!1),n===void 0?r=void 0:(r=new n(i),r._$AT(i,e,s)),s!==void 0?(e._$Co??=[])[s]=r:e._$Cl=r),r!==void 0&&(t=q(i,r._$AS(i,t.values),r,s)),t}var ge=class{constructor(t,e){this._$AV=[],this._$AN=void 0,this._$AD=t,this._$AM=e}get parentNode(){return this._$AM.parentNode}get _$AU(){return this._$AM._$AU}u(t){let{el:{content:e},parts:s}=this._$AD,r=(t?.creationScope??U).importNode(e,!0);N.currentNode=r;let n=N.nextNode(),o=0,a=0,l=s[0];for(;l!==void 0;){if(o===l.index){let c;l.type===2?c=new V(n,n.nextSibling,this,t):l.type===1?c=new l.ctor(n,l.name,l.strings,this,t):l.type===6&&(c=new we(n,this,t)),this._$AV.push(c),l=s[++a]}o!==l?.index&&(n=N.nextNode(),o++)}return N.currentNode=U,r}p(t){let e=0;for(let s of this._$AV)s!==void 0&&(s.strings!==void 0?(s._$AI(t,s,e),e+=s.strings.length-2):s._$AI(t[e])),e++}},V=class i{get _$AU(){return this._$AM?._$AU??this._$Cv}constructor(t,e,s,r){this.type=2,this._$AH=u,this._$AN=void 0,this._$AA=t,this._$AB=e,this._$AM=s,this.options=r,this._$Cv=r?.isConnected??!0}get parentNode(){let t=this._$AA.parentNode,e=this._$AM;return e!==void 0&&t?.nodeType===11&&(t=e.parentNode),t}get startNode(){return this._$AA}get endNode(){return this._$AB}_$AI(t,e=this){t=q(this,t,e),ne(t)?t===u||t==null||t===""?(this._$AH!==u&&this._$AR(),this._$AH=u):t!==this._$AH&&t!==A&&this._(t):t._$litType$!==void 0?this.$(t):t.nodeType!==void 0?this.T(t):_t(t)?this.k(t):this._(t)}O(t){return this._$AA.parentNode.insertBefore(t,this._$AB)}T(t){this._$AH!==t&&(this._$AR(),this._$AH=this.O(t))}_(t){this._$AH!==u&&ne(this._$AH)?this._$AA.nextSibling.data=t:this.T(U.createTextNode(t)),this._$AH=t}$(t){let{values:e,_$litType$:s}=t,r=typeof s=="number"?this._$AC(t):(s.el===void 0&&(s.el=oe.createElement(Et(s.h,s.h[0]),this.options)),s);if(this._$AH?._$AD===r)this._$AH.p(e);else{let n=new ge(r,this),o=n.u(this.options);n.p(e),this.T(o),this._$AH=n}}_$AC(t){let e=wt.get(t.strings);return e===void 0&&wt.set(t.strings,e=new oe(t)),e}k(t){Ve(this._$AH)||(this._$AH=[],this._$AR());let e=this._$AH,s,r=0;for(let n of t)r===e.length?e.push(s=new i(this.O(ie()),this.O(ie()),this,this.options)):s=e[r],s._$AI(n),r++;r<e.length&&(this._$AR(s&&s._$AB.nextSibling,r),e.length=r)}_$AR(t=this._$AA.nextSibling,e){for(this._$AP?.(!1,!0,e);t!==this._$AB;){let s=ft(t).nextSibling;ft(t).remove(),t=s}}setConnected(t){this._$AM===void 0&&(this._$Cv=t,this._$AP?.(t))}},B=class{get tagName(){return this.element.tagName}get _$AU(){return this._$AM._$AU}constructor(t,e,s,r,n){this.type=1,this._$AH=u,this._$AN=void 0,this.element=t,this.name=e,this._$AM=r,this.options=n,s.length>2||s[0]!==""||s[1]!==""?(this._$AH=Array(s.length-1).fill(new String),this.strings=s):this._$AH=u}_$AI(t,e=this,s,r){let n=this.strings,o=!1;if(n===void 0)t=q(this,t,e,0),o=!ne(t)||t!==this._$AH&&t!==A,o&&(this._$AH=t);else{let a=t,l,c;for(t=n[0],l=0;l<n.length-1;l++)c=q(this,a[s+l],e,l),c===A&&(c=this._$AH[l]),o||=!ne(c)||c!==this._$AH[l],c===u?t=u:t!==u&&(t+=(c??"")+n[l+1]),this._$AH[l]=c}o&&!r&&this.j(t)}j(t){t===u?this.element.removeAttribute(this.name):this.element.setAttribute(this.name,t??"")}},ye=class extends B{constructor(){super(...arguments),this.type=3}j(t){this.element[this.name]=t===u?void 0:t}},$e=class extends B{constructor(){super(...arguments),this.type=4}j(t){this.element.toggleAttribute(this.name,!!t&&t!==u)}},be=class extends B{constructor(t,e,s,r,n){super(t,e,s,r,n),this.type=5}_$AI(t,e=this){if((t=q(this,t,e,0)??u)===A)return;let s=this._$AH,r=t===u&&s!==u||t.capture!==s.capture||t.once!==s.once||t.passive!==s.passive,n=t!==u&&(s===u||r);r&&this.element.removeEventListener(this.name,this,s),n&&this.element.addEventListener(this.name,this,t),this._$AH=t}handleEvent(t){typeof this._$AH=="function"?this._$AH.call(this.options?.host??this.element,t):this._$AH.handleEvent(t)}},we=class{constructor(t,e,s){this.element=t,this.type=6,this._$AN=void 0,this._$AM=e,this.options=s}get _$AU(){return this._$AM._$AU}_$AI(t){q(this,t)}},St={M:We,P:C,A:ze,C:1,L:kt,R:ge,D:_t,V:q,I:V,H:B,N:$e,U:be,B:ye,F:we},gs=Fe.litHtmlPolyfillSupport;gs?.(oe,V),(Fe.litHtmlVersions??=[]).push("3.3.3");var Rt=(i,t,e)=>{let s=e?.renderBefore??t,r=s._$litPart$;if(r===void 0){let n=e?.renderBefore??null;s._$litPart$=r=new V(t.insertBefore(ie(),n),n,void 0,e??{})}return r._$AI(i),r};var Ge=globalThis,S=class extends T{constructor(){super(...arguments),this.renderOptions={host:this},this._$Do=void 0}createRenderRoot(){let t=super.createRenderRoot();return this.renderOptions.renderBefore??=t.firstChild,t}update(t){let e=this.render();this.hasUpdated||(this.renderOptions.isConnected=this.isConnected),super.update(t),this._$Do=Rt(e,this.renderRoot,this.renderOptions)}connectedCallback(){super.connectedCallback(),this._$Do?.setConnected(!0)}disconnectedCallback(){super.disconnectedCallback(),this._$Do?.setConnected(!1)}render(){return A}};S._$litElement$=!0,S.finalized=!0,Ge.litElementHydrateSupport?.({LitElement:S});var ys=Ge.litElementPolyfillSupport;ys?.({LitElement:S});(Ge.litElementVersions??=[]).push("4.2.2");var $s={attribute:!0,type:String,converter:se,reflect:!1,hasChanged:fe},bs=(i=$s,t,e)=>{let{kind:s,metadata:r}=e,n=globalThis.litPropertyMetadata.get(r);if(n===void 0&&globalThis.litPropertyMetadata.set(r,n=new Map),s==="setter"&&((i=Object.create(i)).wrapped=!0),n.set(e.name,i),s==="accessor"){let{name:o}=e;return{set(a){let l=t.get.call(this);t.set.call(this,a),this.requestUpdate(o,l,i,!0,a)},init(a){return a!==void 0&&this.C(o,void 0,i,a),a}}}if(s==="setter"){let{name:o}=e;return function(a){let l=this[o];t.call(this,a),this.requestUpdate(o,l,i,!0,a)}}throw Error("Unsupported decorator location: "+s)};function x(i){return(t,e)=>typeof e=="object"?bs(i,t,e):((s,r,n)=>{let o=r.hasOwnProperty(n);return r.constructor.createProperty(n,s),o?Object.getOwnPropertyDescriptor(r,n):void 0})(i,t,e)}function $(i){return x({...i,state:!0,attribute:!1})}var M=(i,t,e)=>(e.configurable=!0,e.enumerable=!0,Reflect.decorate&&typeof t!="object"&&Object.defineProperty(i,t,e),e);function L(i,t){return(e,s,r)=>{let n=o=>o.renderRoot?.querySelector(i)??null;if(t){let{get:o,set:a}=typeof s=="object"?e:r??(()=>{let l=Symbol();return{get(){return this[l]},set(c){this[l]=c}}})();return M(e,s,{get(){let l=o.call(this);return l===void 0&&(l=n(this),(l!==null||this.hasUpdated)&&a.call(this,l)),l}})}return M(e,s,{get(){return n(this)}})}}var ws;function _e(i){return(t,e)=>M(t,e,{get(){return(this.renderRoot??(ws??=document.createDocumentFragment())).querySelectorAll(i)}})}function xe(i){let t=i.n_verified===i.n_decisions;return p`<span class="badge ${t?"good":"bad"}">
    ${t?"verified":"not verified"}: ${i.n_verified} of ${i.n_decisions} decisions
  </span>`}function y(i,t){let e=Math.floor(i/t);return`${Math.floor(e/60)}:${String(e%60).padStart(2,"0")}`}function P(i,t,e){return`${i} of ${t}${e&&` ${e}`} delivered`}function Ee(i,t,e){let s=i.filter(r=>Math.sign(r-t)===e);if(s.length!==0)return e>0?Math.min(...s):Math.max(...s)}function At(i,t){let e=-1;return i.forEach((s,r)=>{s.frame<=t&&(e=r)}),e}var Tt=[.5,1,2,4,8],K=class{constructor(t,e,s){this.host=t;this.draw=e;this.isBusy=s;this.frame=0;this.isPlaying=!1;this.speed=1;this.lastTime=0;this.position=0;t.addController(this)}hostDisconnected(){this.isPlaying=!1}reset(t){this.frames=t,this.isPlaying=!1,this.host.requestUpdate()}seek(t){this.isPlaying=!1,this.show(t)}toggle(){this.frames&&(this.frame>=this.frames.last&&this.show(0),this.isPlaying=!this.isPlaying,this.lastTime=performance.now(),this.isPlaying&&requestAnimationFrame(t=>this.advance(t)),this.host.requestUpdate())}jump(t){let e=Ee(this.frames?.events??[],this.frame,t);e!==void 0&&this.seek(e)}press(t){let e=t.composedPath()[0],s=t.altKey&&["[","]"].includes(t.key);if(t.metaKey||(t.ctrlKey||t.altKey)&&!s||e.matches("select, input"))return;let n=t.shiftKey?this.frames?.perSecond??30:1,a={" ":()=>this.toggle(),ArrowLeft:()=>this.seek(this.frame-n),ArrowRight:()=>this.seek(this.frame+n),"[":()=>this.jump(-1),"]":()=>this.jump(1),Home:()=>this.seek(0),End:()=>this.seek(this.frames?.last??0)}[t.key];!a||t.key===" "&&e.matches("button, summary")||(t.preventDefault(),a())}show(t){this.frames&&(this.frame=Math.max(0,Math.min(Math.round(t),this.frames.last)),this.position=this.frame,this.draw(this.frame),this.host.requestUpdate())}advance(t){if(!this.isPlaying||!this.frames)return;let e=Math.max(0,Math.min(t-this.lastTime,250))/1e3;this.lastTime=t,this.position+=e*this.speed*this.frames.perSecond;let s=Math.min(Math.floor(this.position),this.frames.last);s!==this.frame&&!this.isBusy()&&(this.frame=s,this.draw(s)),this.frame>=this.frames.last?this.isPlaying=!1:requestAnimationFrame(r=>this.advance(r)),this.host.requestUpdate()}};var _s={previous:"M3 3h3v14H3z M17 3v14L7 10z",back:"M15 3v14L5 10z",play:"M5 3v14l12-7z",pause:"M4 3h4v14H4z M12 3h4v14h-4z",forward:"M5 3v14l10-7z",next:"M14 3h3v14h-3z M3 3v14l10-7z"};function ke(i,t,e,s){let r=(c,d,h)=>p`<button type="button" aria-label=${c} title=${c} @click=${h}>
      <svg viewBox="0 0 20 20" aria-hidden="true">${w`<path d=${_s[d]}></path>`}</svg>
    </button>`,[n,o]=i.isPlaying?["Pause (space)","pause"]:["Play (space)","play"],{frame:a,speed:l}=i;return p`<div class="controls" role="group" aria-label="Playback">
    ${r("Previous event ([)","previous",()=>i.jump(-1))}
    ${r("Previous frame (left arrow)","back",()=>i.seek(a-1))}
    ${r(n,o,()=>i.toggle())}
    ${r("Next frame (right arrow)","forward",()=>i.seek(a+1))}
    ${r("Next event (])","next",()=>i.jump(1))}
    <label>
      Speed
      <select @change=${c=>i.speed=Number(c.target.value)}>
        ${Tt.map(c=>p`<option value=${c} ?selected=${c===l}>${c}x</option>`)}
      </select>
    </label>
    <label class="seek">
      <span class="hidden">Frame</span>
      <input
        type="range"
        min="0"
        max=${t}
        .value=${String(a)}
        aria-valuetext="${y(a,e)} of ${y(t,e)}"
        @input=${c=>i.seek(Number(c.target.value))}
      />
    </label>
    <span class="time">${y(a,e)} / ${y(t,e)}, frame ${a}</span>
    <span class="time">${s}</span>
  </div>`}function Ct(i,t){let e=(o,a)=>o.decisions.filter(l=>a.agents.some(c=>c.id===l.agent)),[s,r]=[e(i,t),e(t,i)],n=Math.max(s.length,r.length);for(let o=0;o<n;o++){let[a,l]=[s[o],r[o]];if(a&&l&&a.frame===l.frame&&a.agent===l.agent&&a.text===l.text)continue;return{frame:Math.min(a?.frame??1/0,l?.frame??1/0),decisions:[a,l]}}}function Xe(i,t){return i.filter(e=>e.frame<=t).at(-1)?.done??0}function Mt(i){return`M0 1${i.timeline.deliveries.map(({frame:e,done:s})=>`H${e}V${(1-s/i.total).toFixed(4)}`).join("")}H${i.last_frame}`}var I={view:512,map:720};function O(i,t){let s=(i?.clientWidth??0)*devicePixelRatio;return Math.min(Math.max(64*Math.ceil(s/64),64),t)}function F(i,{width:t,height:e,rgba:s}){let r=i?.getContext("2d");!i||!r||((i.width!==t||i.height!==e)&&(i.width=t,i.height=e),r.putImageData(new ImageData(s,t,e),0,0))}function Se(i,t){F(i,t);let e=i?.getContext("2d");if(e){e.lineJoin="round",e.lineWidth=2;for(let{text:s,at:r,font_px:n,width_px:o,align:a,color:l,border:c}of t.labels)e.font=`${n.toFixed(1)}px ui-monospace, Menlo, Consolas, monospace`,e.textAlign=a,c&&(e.strokeStyle=`rgb(${c.join(" ")})`,e.strokeText(s,...r,o)),e.fillStyle=`rgb(${l.join(" ")})`,e.fillText(s,...r,o)}}function ae(i,t,e){let s=URL.createObjectURL(new Blob([i],{type:"text/javascript"})),r=new Worker(s);return URL.revokeObjectURL(s),r.onmessage=n=>t(n.data),r.onerror=n=>e(n.message||"the worker has stopped"),r}function Lt(i,t,e){return new Promise(s=>{let r=a=>{o.terminate(),s(a)};e.addEventListener("abort",()=>r());let o=ae(i,r,a=>r({type:"error",message:a}));o.postMessage(t)})}var G=class{constructor(t,e,s,r,n,o){this.wanted=s;this.onInfo=r;this.onFrame=n;this.onError=o;this.isBusy=!1;this.isOpen=!1;this.worker=ae(t,d=>this.receive(d),o);let{module:a,trace:l,episode:c}=e;this.post({type:"open",module:a,trace:l,episode:c})}seek(t){this.next=t,this.drawNext()}rerun(t){this.onRerun=t;let e={type:"rerun"};this.worker.postMessage(e)}get isDrawing(){return this.isBusy}close(){this.worker.terminate()}post(t){this.isBusy=!0,this.worker.postMessage(t)}drawNext(){if(this.isBusy||this.next===void 0||!this.isOpen)return;let t=this.next;this.next=void 0,this.post({type:"frame",frame:t,...this.wanted()})}receive(t){if(t.type==="rerun"){this.onRerun?.(t.state);return}if(t.type==="verified"){this.onInfo(t.info);return}this.isBusy=!1,t.type==="opened"?(this.isOpen=!0,this.onInfo(t.info)):t.type==="frame"?this.onFrame(t):t.type==="error"&&this.onError(t.message),this.drawNext()}};var X=Ue`
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
  .seats button:not(.link),
  .seats select,
  .language button {
    font: inherit;
    min-height: 2rem;
    padding: 0 0.5rem;
  }
  .language pre {
    max-height: 24rem;
    overflow-y: auto;
    overflow-wrap: anywhere;
    white-space: pre-wrap;
  }
  .belief td:not(.number) {
    width: 55%;
  }
`;var Re={ATTRIBUTE:1,CHILD:2,PROPERTY:3,BOOLEAN_ATTRIBUTE:4,EVENT:5,ELEMENT:6},Ae=i=>(...t)=>({_$litDirective$:i,values:t}),Y=class{constructor(t){}get _$AU(){return this._$AM._$AU}_$AT(t,e,s){this._$Ct=t,this._$AM=e,this._$Ci=s}_$AS(t,e){return this.update(t,e)}update(t,e){return this.render(...e)}};var Pt="important",xs=" !"+Pt,le=Ae(class extends Y{constructor(i){if(super(i),i.type!==Re.ATTRIBUTE||i.name!=="style"||i.strings?.length>2)throw Error("The `styleMap` directive must be used in the `style` attribute and must be the only part in the attribute.")}render(i){return Object.keys(i).reduce((t,e)=>{let s=i[e];return s==null?t:t+`${e=e.includes("-")?e:e.replace(/(?:^(webkit|moz|ms|o)|)(?=[A-Z])/g,"-$&").toLowerCase()}:${s};`},"")}update(i,[t]){let{style:e}=i.element;if(this.ft===void 0)return this.ft=new Set(Object.keys(t)),this.render(t);for(let s of this.ft)t[s]==null&&(this.ft.delete(s),s.includes("-")?e.removeProperty(s):e[s]=null);for(let s in t){let r=t[s];if(r!=null){this.ft.add(s);let n=typeof r=="string"&&r.endsWith(xs);s.includes("-")||n?e.setProperty(s,n?r.slice(0,-11):r,n?Pt:""):e[s]=r}}return A}});function Te(i,t,e,s=i.length){let{activities:r,deliveries:n}=i.timeline,o=c=>`${(100*c/Math.max(s,1)).toFixed(3)}%`,a=c=>{let d=c.currentTarget.getBoundingClientRect();e((c.clientX-d.left)/d.width*s)},l=c=>{let d=c.failed&&c.kind==="interact",h={left:o(c.start),width:o(c.end-c.start)},m=d?"failed":c.kind,f=d?p`<span class="mark" style=${le({left:o(c.end)})}>×</span>`:"";return p`<span class="bar ${m}" style=${le(h)}></span>${f}`};return p`<div class="timeline" aria-hidden="true">
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
        ${n.map(({frame:c,by:d})=>p`<span class="mark a${d}" style=${le({left:o(c)})}>▼</span>`)}
      </div>
      ${i.agents.map(({id:c})=>p`<div class="row a${c}">
          ${r.filter(d=>d.agent===c).map(l)}
        </div>`)}
      <span class="now" style=${le({left:o(t)})}></span>
    </div>
  </div>`}var J=class{constructor(t,e){this.host=t;this.onChange=e;this.width=0;this.observer=new ResizeObserver(()=>{this.host.clientWidth!==this.width&&(this.width=this.host.clientWidth,this.onChange())});t.addController(this)}hostConnected(){this.observer.observe(this.host)}hostDisconnected(){this.observer.disconnect()}};var Ot=0,ce=1,R=class extends S{constructor(){super();this.workerSource="";this.start=0;this.infos=[];this.shown=[];this.viewer=ce;this.players=[];this.playback=new K(this,e=>this.moved(e),()=>this.players.length===0||this.players.some(e=>e.isDrawing));new J(this,()=>this.redraw())}static{this.styles=X}disconnectedCallback(){super.disconnectedCallback(),this.close()}updated(e){e.has("sources")&&(this.close(),this.sources?.forEach((s,r)=>this.open(r,s)))}seek(e){(!this.infos[0]||!this.infos[1])&&(this.start=e),this.playback.seek(e)}get frame(){return this.playback.frame}close(){this.players.forEach(e=>e.close()),this.players=[],this.infos=[],this.shown=[],this.problem=void 0,this.playback.reset()}open(e,s){let r=l=>{if(!l.is_complete)return;this.infos=It(this.infos,e,l);let[c,d]=this.infos;c&&d&&this.begin(c,d)},n=()=>({agents:[this.viewer],viewPx:O(this.viewCanvases[0],I.view),mapPx:e===0?O(this.mapCanvas,I.map):0,memories:[],withLimits:!1}),o=({state:l,views:c,map:d})=>{this.shown=It(this.shown,e,l),c[0]&&F(this.viewCanvases[e],c[0]),d&&Se(this.mapCanvas,d)},a=l=>{this.problem=l};this.players[e]=new G(this.workerSource,s,n,r,o,a)}begin(e,s){if(e.episode!==s.episode||e.seed!==s.seed){this.problem="the runs are not of the same episode and seed";return}let r=[e,s].every(a=>a.agents.some(l=>l.id===ce&&a.helper!=="none"));this.viewer=r?ce:Ot;let n=[e,s].flatMap(a=>a.timeline.story.map(l=>l.frame)).sort((a,l)=>a-l),o=Math.max(e.last_frame,s.last_frame);this.playback.reset({last:o,perSecond:e.frames_per_second,events:n}),this.updateComplete.then(()=>this.seek(this.start))}moved(e){this.players.forEach(s=>s.seek(e)),this.dispatchEvent(new CustomEvent("moved",{detail:e}))}redraw(){!this.infos[0]||!this.infos[1]||this.players.forEach(e=>e.seek(this.frame))}render(){let[e,s]=this.infos;if(this.problem||!e||!s)return p`<p role="status">${this.problem?`Cannot compare: ${this.problem}`:"Replaying ..."}</p>`;let r=[e,s],n=Math.max(e.last_frame,s.last_frame);return p`<section aria-label="Comparison" @keydown=${o=>this.playback.press(o)}>
      ${this.heading(r)} ${this.pictures(r)}
      ${ke(this.playback,n,e.frames_per_second,this.status(r))}
      ${ks(r,n,this.frame,o=>this.seek(o))}
      ${r.map(o=>p`<h3>${_(o)}</h3>
          ${Te(o,this.frame,a=>this.seek(a),n)}`)}
      <div class="columns">${r.map(o=>this.story(o))}</div>
    </section>`}heading(e){let[s,r]=e,n=o=>p`<p>
        <b>${_(o)}</b>: ${P(Xe(o.timeline.deliveries,o.last_frame),o.total,o.unit)}.
        ${xe(o)}
        ${o.problem?p`<span class="problem" role="alert">
              Shown up to frame ${o.last_frame} of ${o.length}: ${o.problem}
            </span>`:u}
      </p>`;return p`<header>
      <h2>${s.task}: ${_(s)} and ${_(r)}</h2>
      ${e.map(n)} ${this.difference(e)}
      <p class="small">${s.episode}, seed ${s.seed}, chaic ${s.chaic}</p>
    </header>`}difference(e){let[s,r]=e,n=Ct(s,r);if(!n)return p`<p>Both runs are equal.</p>`;let o=s.agents.map(d=>d.name),a=d=>d?`the ${o[d.agent]??"agent"} ${d.text} (frame ${d.frame})`:"no more decisions",[l,c]=n.decisions;return p`<p>
      First different decision:
      <button type="button" class="link" @click=${()=>this.seek(n.frame)}>
        ${y(n.frame,s.frames_per_second)}
      </button>
      <br />${_(s)}: ${a(l)}; ${_(r)}: ${a(c)}
    </p>`}pictures(e){let s=e[0].agents.filter(o=>o.id<=ce&&e[1].agents.some(({id:a})=>a===o.id)),r=o=>{this.viewer=Number(o.target.value),this.redraw()},n=e.map((o,a)=>{let l=this.shown[a]?.captions[this.viewer];return p`<figure class="run${a}">
        <canvas class="view" width="384" height="384" role="img" aria-label="View with ${_(o)}"></canvas>
        <figcaption>
          <b>${_(o)}</b>${l?p`: ${l.action}<br />Plan: ${l.plan||"none"}`:u}
        </figcaption>
      </figure>`});return p`<p>
        <label>
          Views of the
          <select @change=${r}>
            ${s.map(o=>p`<option value=${o.id} ?selected=${o.id===this.viewer}>${o.name}</option>`)}
          </select>
        </label>
      </p>
      <div class="pictures">
        ${n}
        <figure>
          <div class="overlaid">
            <canvas class="map" width="480" height="480" role="img" aria-label="Map with the trails of both runs"></canvas>
            ${Es(e,this.frame)}
          </div>
          <figcaption>Trails so far: solid with ${_(e[0])}, dashed with ${_(e[1])}; objects as with ${_(e[0])}</figcaption>
        </figure>
      </div>`}status(e){let s=e.map(r=>Xe(r.timeline.deliveries,this.frame));return P(s.join(" and "),e[0].total,e[0].unit)}story(e){return p`<div class="story">
      <h3>Events: ${_(e)}</h3>
      <ol>
        ${e.timeline.story.map(s=>p`<li>
            <button type="button" @click=${()=>this.seek(s.frame)}>
              <span class="time">${y(s.frame,e.frames_per_second)}</span> ${s.text}
            </button>
          </li>`)}
      </ol>
    </div>`}};v([x({attribute:!1})],R.prototype,"sources",2),v([x({attribute:!1})],R.prototype,"workerSource",2),v([x({type:Number})],R.prototype,"start",2),v([$()],R.prototype,"infos",2),v([$()],R.prototype,"shown",2),v([$()],R.prototype,"problem",2),v([$()],R.prototype,"viewer",2),v([_e("canvas.view")],R.prototype,"viewCanvases",2),v([L("canvas.map")],R.prototype,"mapCanvas",2);function _(i){let t=i.helper==="none"?"no helper":i.helper;return i.branch_at===null?t:`${t} from ${y(i.branch_at,i.frames_per_second)}`}function It(i,t,e){let s=[...i];return s[t]=e,s}function Es(i,t){let e=(s,r,n)=>{let o=(s.trails[n]??[]).slice(0,1+Math.floor(t/s.trail_interval));if(o.length===0)return u;let[a,l]=o.at(-1);return w`<polyline class="a${n} run${r}" points=${o.join(" ")}></polyline>
      <circle class="a${n} run${r}" cx=${a} cy=${l} r="0.012"></circle>`};return p`<svg class="trails" viewBox="0 0 1 4" preserveAspectRatio="xMidYMin slice" aria-hidden="true">
    ${i.flatMap((s,r)=>[Ot,ce].map(n=>e(s,r,n)))}
  </svg>`}function ks(i,t,e,s){let r=n=>{let o=n.currentTarget.getBoundingClientRect();s((n.clientX-o.left)/o.width*t)};return p`<h3>Delivered over time</h3>
    <svg class="chart" viewBox="0 -0.05 ${Math.max(t,1)} 1.1" preserveAspectRatio="none" aria-hidden="true" @pointerdown=${r}>
      ${i.map((n,o)=>w`<path class="run${o}" d=${Mt(n)}></path>`)}
      ${w`<path class="now" d="M${e} -0.05V1.05"></path>`}
    </svg>
    <p class="legend">From none to all; solid: ${_(i[0])}, dashed: ${_(i[1])}</p>`}customElements.define("chaic-compare",R);async function Ce(i){let t=Uint8Array.from(atob(i.textContent.trim()),s=>s.charCodeAt(0)),e=new Blob([t]).stream().pipeThrough(new DecompressionStream("deflate-raw"));return new Response(e).arrayBuffer()}var Ye=()=>Ce(document.getElementById("chaic-module")),Z=()=>document.getElementById("chaic-worker").textContent;var{I:Ss}=St,Ht=i=>i;var Dt=()=>document.createComment(""),Q=(i,t,e)=>{let s=i._$AA.parentNode,r=t===void 0?i._$AB:t._$AA;if(e===void 0){let n=s.insertBefore(Dt(),r),o=s.insertBefore(Dt(),r);e=new Ss(n,o,i,i.options)}else{let n=e._$AB.nextSibling,o=e._$AM,a=o!==i;if(a){let l;e._$AQ?.(i),e._$AM=i,e._$AP!==void 0&&(l=i._$AU)!==o._$AU&&e._$AP(l)}if(n!==r||a){let l=e._$AA;for(;l!==n;){let c=Ht(l).nextSibling;Ht(s).insertBefore(l,r),l=c}}}return e},H=(i,t,e=i)=>(i._$AI(t,e),i),Rs={},jt=(i,t=Rs)=>i._$AH=t,Nt=i=>i._$AH,Me=i=>{i._$AR(),i._$AA.remove()};var Ut=(i,t,e)=>{let s=new Map;for(let r=t;r<=e;r++)s.set(i[r],r);return s},qt=Ae(class extends Y{constructor(i){if(super(i),i.type!==Re.CHILD)throw Error("repeat() can only be used in text expressions")}dt(i,t,e){let s;e===void 0?e=t:t!==void 0&&(s=t);let r=[],n=[],o=0;for(let a of i)r[o]=s?s(a,o):o,n[o]=e(a,o),o++;return{values:n,keys:r}}render(i,t,e){return this.dt(i,t,e).values}update(i,[t,e,s]){let r=Nt(i),{values:n,keys:o}=this.dt(t,e,s);if(!Array.isArray(r))return this.ut=o,n;let a=this.ut??=[],l=[],c,d,h=0,m=r.length-1,f=0,g=n.length-1;for(;h<=m&&f<=g;)if(r[h]===null)h++;else if(r[m]===null)m--;else if(a[h]===o[f])l[f]=H(r[h],n[f]),h++,f++;else if(a[m]===o[g])l[g]=H(r[m],n[g]),m--,g--;else if(a[h]===o[g])l[g]=H(r[h],n[g]),Q(i,l[g+1],r[h]),h++,g--;else if(a[m]===o[f])l[f]=H(r[m],n[f]),Q(i,r[h],r[m]),m--,f++;else if(c===void 0&&(c=Ut(o,f,g),d=Ut(a,h,m)),c.has(a[h]))if(c.has(a[m])){let b=d.get(o[f]),D=b!==void 0?r[b]:null;if(D===null){let z=Q(i,r[h]);H(z,n[f]),l[f]=z}else l[f]=H(D,n[f]),Q(i,r[h],D),r[b]=null;f++}else Me(r[m]),m--;else Me(r[h]),h++;for(;f<=g;){let b=Q(i,l[g+1]);H(b,n[f]),l[f++]=b}for(;h<=m;){let b=r[h++];b!==null&&Me(b)}return this.ut=o,jt(i,l),A}});var As=[1,1.5,2.5,4],Ts=1.5,Le=class{constructor(t,e){this.host=t;this.choices=e;this.timer=0;this.isOn=!1;this.seconds=Ts}stop(){this.set(!1)}controls(t){let e=r=>this.set(r.target.checked),s=r=>{this.seconds=Number(r.target.value),this.set(this.isOn),r.target.blur()};return p`<label>
        <input type="checkbox" class="scan" .checked=${this.isOn} @change=${e} />
        ${t}
      </label>
      ${this.isOn?p`<label>
            Time for each choice
            <select @change=${s}>
              ${As.map(r=>p`<option value=${r} ?selected=${r===this.seconds}>${r} s</option>`)}
            </select>
          </label>`:u}`}set(t){clearInterval(this.timer),this.isOn=t,this.timer=t?window.setInterval(()=>this.next(),1e3*this.seconds):0,this.host.requestUpdate()}next(){let t=document.activeElement;for(;t?.shadowRoot?.activeElement;)t=t.shadowRoot.activeElement;if(t?.matches("select"))return;let e=this.choices(),s=e.findIndex(r=>r===t);e[(s+1)%e.length]?.focus()}};var Bt=512,Ft=["none","rhp","oracle"],Wt=15,E=class extends S{constructor(){super(...arguments);this.workerSource="";this.story=[];this.references=new Map;this.pointing={kind:"pick_up",hand:"left"};this.isBusy=!1;this.isOver=!1;this.lastTime=0;this.elapsedFrames=0;this.scanner=new Le(this,()=>this.choices());this.recordedFrame=0;this.nTraceRequests=0}static{this.styles=X}connectedCallback(){super.connectedCallback(),this.tabIndex=-1}disconnectedCallback(){super.disconnectedCallback(),this.close()}updated(e){e.has("game")&&this.game&&this.open(this.game)}close(){this.simulator?.close(),this.simulator=void 0,this.scanner.stop(),this.info=this.shown=this.problem=void 0,this.story=[],this.references=new Map,this.isOver=!1,this.recordedFrame=this.nTraceRequests=0}open(e){this.close();let s=l=>this.receive(l);this.simulator=e.startSimulator?.(s)??this.startWorker(s);let{module:r,episode:n,config:o,branch:a}=e;this.post({type:"play",module:r,episode:n,config:{...o,is_live:e.isLive},branch:a})}startWorker(e){let s=ae(this.workerSource,e,r=>this.fail(r));return{post:r=>s.postMessage(r),close:()=>s.terminate()}}post(e){this.isBusy=!0,this.simulator?.post(e)}receive(e){switch(this.isBusy=!1,e.type){case"playing":this.info=e.info,this.updateComplete.then(()=>this.begin());break;case"live":this.show(e.state),F(this.canvas,e.view);break;case"trace":this.nTraceRequests-=1,this.game?.isStudy&&!this.problem&&this.record(e.trace),this.isOver&&this.nTraceRequests===0&&this.finish(e.trace);break;case"reference":this.references=new Map(this.references).set(e.helper,e.rate),this.compareNext();break;case"over":this.isOver=!0,this.dispatchEvent(new CustomEvent("over",{detail:"ended"}));break;case"error":this.fail(e.message);break}}fail(e){this.problem??=e,this.game?.isStudy?this.dispatchEvent(new CustomEvent("over",{detail:"left"})):this.shown&&this.stop()}begin(){this.lastTime=performance.now(),this.elapsedFrames=1,requestAnimationFrame(e=>this.advance(e))}advance(e){if(!this.simulator||this.problem||this.isOver)return;let s=(this.game?.speed??1)*(this.info?.frames_per_second??0);this.elapsedFrames+=Math.min(e-this.lastTime,250)/1e3*s,this.elapsedFrames=Math.min(this.elapsedFrames,Math.max(s,1)),this.lastTime=e;let r=this.shown?.status==="waiting"&&!this.input&&!this.game?.isLive,n=Math.floor(this.elapsedFrames);if(!this.isBusy&&n>0&&(!r||this.input)){this.elapsedFrames-=n;let o=O(this.canvas,I.view);this.post({type:"advance",frames:n,viewPx:o,input:this.input}),this.input&&(this.recordedFrame=-Wt),this.input=void 0}else r&&(this.elapsedFrames=Math.min(this.elapsedFrames,1));requestAnimationFrame(o=>this.advance(o))}show(e){let s=e.status==="waiting"&&this.shown?.status!=="waiting",r=this.shadowRoot?.activeElement?.closest(".plans")!=null,n=s?[]:(this.shown?.plans??[]).filter(a=>e.plans.includes(a)),o=e.plans.filter(a=>!n.includes(a));this.shown={...e,plans:[...n,...o]},e.events.length>0&&(this.story=[...this.story,...e.events]),e.status==="ended"?this.stop():this.game?.isStudy&&(s||e.frame-this.recordedFrame>=Wt)&&(this.recordedFrame=e.frame,this.requestTrace()),this.updateComplete.then(()=>{(s||r&&!this.shadowRoot?.activeElement)&&this.focusChoices()})}focusChoices(){let e=document.activeElement;if(e!==document.body&&e!==this)return;let s=this.shadowRoot?.querySelector("section"),r=this.shadowRoot?.activeElement;if(r&&r!==s&&!r.closest(".plans"))return;let n=s?.querySelector(".plans button");n?n.focus():s?.focus({preventScroll:!0})}stop(){this.isOver||(this.isOver=!0,this.scanner.stop(),this.requestTrace())}requestTrace(){this.nTraceRequests+=1,this.post({type:"trace",isPartial:this.game?.isStudy??!1})}record(e){e&&this.dispatchEvent(new CustomEvent("recorded",{detail:e}))}finish(e){let{episode:s,isStudy:r}=this.game;if(r){let n=this.shown?.status==="ended"?"ended":"stopped";this.dispatchEvent(new CustomEvent("over",{detail:n}));return}this.dispatchEvent(new CustomEvent("finished",{detail:{trace:e,episode:s}})),this.shown?.status==="ended"&&this.compareNext()}compareNext(){let e=Ft.find(s=>!this.references.has(s));e&&this.post({type:"reference",helper:e})}choose(e){let s=this.shown?.plans[e];this.shown?.status==="waiting"&&!this.isOver&&s!==void 0&&(this.input={plan:s})}act(e){this.shown?.status==="waiting"&&(this.input={action:e})}point(e){if(this.game?.config.level!=="steps")return;let s=e.currentTarget.getBoundingClientRect(),r=(c,d)=>Math.max(0,Math.min(Bt-1,Math.floor(c/d*Bt))),n={column:r(e.clientX-s.left,s.width),row:r(e.clientY-s.top,s.height)},{kind:o,hand:a}=this.pointing,l={pick_up:"object",put_on:"place",remove_obstacle:"obstacle"}[o];this.act({[o]:{[l]:{pixel:n},hand:a}})}press(e){let s=e.composedPath()[0];if(e.ctrlKey||e.altKey||e.metaKey||s.matches("select, input"))return;let r=this.game?.config.level==="steps",n=/^[1-9]$/.test(e.key)&&!e.repeat?Number(e.key)-1:void 0,a=r?{ArrowUp:"move_forward",ArrowLeft:"turn_left",ArrowRight:"turn_right",".":{wait:{frames:10}}}[e.key]:void 0;if(a)this.act(a);else if(!r&&n!==void 0)this.choose(n);else return;e.preventDefault()}choices(){return[...this.shadowRoot.querySelectorAll(".plans button, button.link, input.scan")]}render(){let{info:e,shown:s}=this;if(this.problem)return p`<p class="problem" role="alert">Cannot play: ${this.problem}</p>`;if(!e)return this.isOver?p``:p`<p role="status">Loading ...</p>`;let r=this.game?.config.level==="plans"?this.plans(s):this.steps(s);return p`<section aria-label="Play" tabindex="-1" @keydown=${n=>this.press(n)}>
      ${this.heading(e)}
      <div class="columns">
        <figure class="a${this.game?.config.seat??0}">
          <canvas
            class="view"
            width="512"
            height="512"
            role="img"
            aria-label="What you see"
            @click=${n=>this.point(n)}
          ></canvas>
        </figure>
        <div>
          ${s?this.status(s):u}
          ${this.isOver?u:p`${r}
                <p><button type="button" class="link" @click=${()=>this.stop()}>Stop here</button></p>`}
          ${s?.status==="ended"&&!this.game?.isStudy?this.result(s):u} ${this.events()}
        </div>
      </div>
    </section>`}heading(e){let s=this.game?.config.seat===1,[r,n]=e.reach_m.map(a=>a.toFixed(2)),o=s?"The partner wants something that you do not know. Find out and help.":`Your body: ${e.person}. You want ${e.goal.join(", ")}.`;return p`<header>
      <h2>${e.task}: you are the ${s?"helper":"partner"}</h2>
      <p>${o} You reach from ${r} to ${n} m and lift ${e.strength_kg.toFixed(0)} kg.</p>
      <p class="small">${e.episode?`${e.episode}. `:""}A simulation: real people differ from these bodies and views.</p>
    </header>`}time(e){return y(e,this.info?.frames_per_second??1)}status(e){let{action:s,plan:r}=e.caption,n=e.hands.map(l=>l??"nothing"),o=e.progress?`, ${P(...e.progress,this.info?.unit??"")}`:"",a=e.is_refused?"Your last choice was no longer possible. Choose again.":"";return p`<p class="time">
        ${this.time(e.frame)} of ${this.time(e.horizon)}${o}
      </p>
      <p>Left hand: ${n[0]}; right hand: ${n[1]}</p>
      <p role="status">You: ${s}${r?` (${r})`:""}${e.failure?`; failed: ${e.failure}`:""}</p>
      <p role="status">${this.isOver?"The game has ended.":a}</p>`}plans(e){return p`<h3>What next?</h3>
      <ol class="plans">
        ${qt(e?.plans??[],s=>s,(s,r)=>p`<li><button type="button" @click=${()=>this.choose(r)}>${s}</button></li>`)}
      </ol>
      ${e?.status==="running"?p`<p>Doing it ...</p>`:u}
      ${this.game?.isStudy?u:this.scanner.controls("Offer one plan after the other, for a single switch")}`}steps(e){let s=(o,a)=>p`<button type="button" @click=${()=>this.act(a)}>${o}</button>`,r=o=>{let[a,l]=o.target.value.split(" ");this.pointing={kind:a,hand:l}},n=[["pick_up left","picks up with the left hand"],["pick_up right","picks up with the right hand"],["put_on left","puts what the left hand holds there"],["put_on right","puts what the right hand holds there"],["remove_obstacle left","removes an obstacle"]];return p`<div class="controls" role="group" aria-label="Actions">
        ${s("Turn left (left arrow)","turn_left")} ${s("Walk (up arrow)","move_forward")}
        ${s("Turn right (right arrow)","turn_right")} ${s("Put into the container","put_in")}
        ${s("Wait (.)",{wait:{frames:10}})}
      </div>
      <label>
        A click on the picture
        <select @change=${r}>
          ${n.map(([o,a])=>p`<option value=${o}>${a}</option>`)}
        </select>
      </label>
      ${e?.status==="running"?p`<p>Acting ...</p>`:u}`}result(e){let[s,r]=e.progress??[0,0],n=r>0?s/r:0,o=l=>l===void 0?"...":`${(100*l).toFixed(0)} %`,a=this.game?.config.seat===1?"your help":"you as the partner";return p`<h3>Result</h3>
      <table>
        <caption>Delivered part of the goal, same episode and seed</caption>
        <tr><th scope="row">${a}</th><td class="number">${o(n)}</td></tr>
        ${Ft.map(l=>p`<tr>
            <th scope="row">simulated partner, ${l==="none"?"no helper":`helper ${l}`}</th>
            <td class="number">${o(this.references.get(l))}</td>
          </tr>`)}
      </table>`}events(){return p`<div class="story">
      <h3>Events</h3>
      <ol reversed>
        ${[...this.story].reverse().map(e=>p`<li><span class="time">${this.time(e.frame)}</span> ${e.text}</li>`)}
      </ol>
    </div>`}};v([x({attribute:!1})],E.prototype,"game",2),v([x({attribute:!1})],E.prototype,"workerSource",2),v([$()],E.prototype,"info",2),v([$()],E.prototype,"shown",2),v([$()],E.prototype,"story",2),v([$()],E.prototype,"problem",2),v([$()],E.prototype,"references",2),v([$()],E.prototype,"pointing",2),v([L("canvas")],E.prototype,"canvas",2),v([$()],E.prototype,"isOver",2);customElements.define("chaic-play",E);function Je(i,t){let e=document.createElement("a");e.href=URL.createObjectURL(new Blob([i],{type:"application/jsonl"})),e.download="trace.jsonl",e.textContent="Download the trace";let s=document.createElement("button");s.type="button",s.textContent="Watch the replay",s.addEventListener("click",t);let r=document.createElement("p");return r.append(e," (chaic verify trace.jsonl checks it) ",s),r}async function zt(i,t,e){let{workerSource:s,pace:r,...n}=t,o=document.createElement("chaic-play");Object.assign(o,{workerSource:s,game:{...n,...r}}),o.addEventListener("finished",a=>{let{detail:l}=a;i.append(Je(l.trace,()=>e(l)))}),i.replaceChildren(o),o.focus({preventScroll:!0})}function Vt(i,t,e,s){return i.map(r=>{let{decisions:n,problem:o}=r,a=n.map(h=>h.frame),l=Math.max(-1,...a.filter(h=>h<=e)),c=(h,m)=>{let f=Ee(a,l,m);return p`<button type="button" ?disabled=${f===void 0} @click=${()=>s(f)}>${h}</button> `},d=n.map((h,m)=>({...h,number:m+1})).filter(h=>h.frame===l);return p`<section class="language" aria-label="Language model of the ${r.agent}">
      <h3>Language model of the ${r.agent}${r.model?`: ${r.model}`:u}</h3>
      ${o?p`<p class="problem">The prompts cannot be shown: ${o}</p>`:u}
      ${n.length>0?p`<p>${c("Previous decision",-1)} ${c("Next decision",1)}</p>`:u}
      ${d.map(({number:h,text:m,passages:f})=>p`<p>
            Decision ${h} of ${n.length}, <b>${y(l,t.frames_per_second)}</b>: ${m}
          </p>
          ${f.map(g=>p`<details>
              <summary>${g.heading}</summary>
              <pre tabindex="0">${g.text}</pre>
            </details>`)}
          ${h>n.length-r.n_left_out?p`<p>Its messages are too long for this page; <code>chaic llm show</code> prints them.</p>`:u}`)}
    </section>`})}var Pe=320,he=210,W=46,Ze=40,Cs=8,Qe=12,Ms=[0,.1,.5,1,2,5,10,20,50,100,200,500],Ie=.5,Ls=2,pe={too_high:{mark:"\u2191",text:"too high"},too_low:{mark:"\u2193",text:"too low"},too_heavy:{mark:"\u25A0",text:"too heavy"}};function Kt(i,t){let[e,s]=i.reach_m,r=1.1*Math.max(.5,...t.map(h=>h.mass_kg)),n=Ie*Math.ceil(Math.max(Ls,...t.map(h=>h.top_m))/Ie),o=h=>W+(Pe-W-Qe)*Math.sqrt(Math.min(h/r,1)),a=h=>he-Ze-(he-Ze-Cs)*Math.min(h/n,1),l=Array.from({length:n/Ie+1},(h,m)=>m*Ie),c=Ps(Ms.filter(h=>h<=r),o),d=({name:h,limits:m,top_m:f,mass_kg:g})=>{let b=[o(g),a(Math.max(f,0))],D=w`<title>${h}, top at ${f.toFixed(2)} m, ${g.toFixed(1)} kg</title>`;if(m.length===0)return w`<circle cx=${b[0]} cy=${b[1]} r="4">${D}</circle>`;let z=m.map(ns=>pe[ns].mark).join("");return w`<text class="beyond" x=${b[0]} y=${b[1]+5} text-anchor="middle">${z}${D}</text>`};return p`<svg class="limits" viewBox="0 0 ${Pe} ${he}" aria-hidden="true">
    ${w`<rect class="region" x=${W} y=${a(s)} width=${o(i.strength_kg)-W}
      height=${a(e)-a(s)}></rect>`}
    ${l.map(h=>w`<line x1=${W} x2=${Pe-Qe} y1=${a(h)} y2=${a(h)}></line>
        <text x=${W-6} y=${a(h)+4} text-anchor="end">${h.toFixed(1)} m</text>`)}
    ${c.map(h=>w`<text x=${o(h)} y=${he-Ze+17} text-anchor="middle">${h}</text>`)}
    ${w`<text x=${(W+Pe-Qe)/2} y=${he-5} text-anchor="middle">mass, kg</text>`}
    ${t.map(d)}
  </svg>`}function Ps(i,t){return i.reduce((s,r)=>s.length>0&&t(r)-t(s.at(-1))<26?s:[...s,r],[])}var Gt=0,Oe=1,Xt={memories:[],objects:[]},st=["partner","helper"],et=["#b8341c","#0b6e72"],rt="#fafaf8",Is="#1e2026",Os=[[30,32,38,150],[0,0,0,0],[0,0,0,0]],Hs=[[190,192,196,255],[250,250,248,255],[70,74,82,255]],Ds=[[208,64,40,70],[16,136,140,70]],it=500,He=class{constructor(t,e){this.host=t;this.onChange=e;this.shown=new Set(["truth","explored","objects","paths"]);this.data=Xt}reset(){this.data=Xt,this.rerun=void 0}get memories(){return[Gt,Oe].filter(t=>this.shown.has(st[t]))}get withLimits(){return this.shown.has("limits")}advanced(t,e){return this.rerun=t,this.host.requestUpdate(),this.memories.length>this.data.memories.length&&(t.frame>e||t.is_complete)}draw(t,e,s,r){this.data=r,this.host.requestUpdate();let n=t?.getContext("2d");if(!(!t||!n)){t.width=e.width,t.height=e.height,n.setTransform(e.width,0,0,e.width,0,0),this.shown.has("truth")||(n.fillStyle=rt,n.fillRect(0,0,1,e.height/e.width)),n.beginPath(),n.rect(0,0,1,s),n.clip(),this.shown.has("explored")&&this.drawExplored(n,r.memories);for(let o of r.memories)this.shown.has("paths")&&Us(n,o),this.shown.has("objects")&&qs(n,o);for(let{at:o,limits:a}of r.objects)Yt(n,[o[0]+.012,o[1]],a.map(l=>pe[l].mark).join(""),Is)}}drawExplored(t,e){let[s,r]=e;if(!s)return;let n=this.shown.has("truth"),o=n?Os:Hs,a=s.cells.length/s.n_columns,l=new ImageData(s.n_columns,a);s.cells.forEach((m,f)=>{let g=r?.cells[f]??0,b=n||Math.max(m,g)===1,z=r!==void 0&&m===0!=(g===0)&&b?Ds[m===0?r.agent:s.agent]:o[Math.max(m,g)];l.data.set(z,4*f)});let c=new OffscreenCanvas(s.n_columns,a);c.getContext("2d").putImageData(l,0,0),t.imageSmoothingEnabled=!1;let[d,h]=s.map_at;t.drawImage(c,d,h,s.n_columns*s.cell,a*s.cell)}choice(t){let e=(n,o)=>p`<label>
        <input type="checkbox" .checked=${this.shown.has(n)} @change=${()=>this.toggle(n)} />
        ${o}
      </label>`,s=t.agents.some(n=>n.id===Oe),r=[e("explored","Explored area"),e("objects","Remembered objects"),e("paths","Planned paths")];return p`<fieldset class="layers">
      <legend>Layers of the map</legend>
      ${e("truth","Truth")} ${e("partner","What the partner knows")}
      ${s?e("helper","What the helper believes"):u} ${e("limits","Limits of the partner")}
      ${this.memories.length>0?r:u}
    </fieldset>`}toggle(t){this.shown.delete(t)||this.shown.add(t),this.onChange(),this.host.requestUpdate()}words(t){if(this.memories.length===0&&!this.withLimits)return u;let e=t.frames_per_second;return p`<details class="words" open>
      <summary>The layers in words</summary>
      ${this.memories.length>0?this.progress(e):u}
      ${this.memories.map(s=>{let r=this.data.memories.find(n=>n.agent===s);return r?Ns(r,e):u})}
      ${this.withLimits?this.limitsInWords(t):u}
    </details>`}progress(t){let{rerun:e}=this,s=p`<p class="small">
      Dark area: not seen. Circles: objects in the partner's memory; squares: in the helper's; dashed: not in view;
      filled: wanted with a probability of at least ${it/10} %. Diamonds: last known positions of people. Lines
      with a dot: planned paths, dashed for the helper.
    </p>`;if(!e?.is_complete){let r=e?.frame??0;return p`<p>The agents run again beside the replay, up to ${y(r,t)} so far.</p>
        ${s}`}return p`<p role="status">
        ${e.agents.filter(({agent:r})=>this.memories.includes(r)).map(js)}
      </p>
      ${s}`}limitsInWords({agents:t}){let e=t[Gt],[s,r]=e.reach_m.map(a=>a.toFixed(2)),{objects:n}=this.data,o=n.filter(a=>a.limits.length>0);return p`<p>
        <b>Limits</b>: the partner (${e.person}) reaches tops from ${s} to ${r} m and lifts
        ${e.strength_kg.toFixed(0)} kg.
      </p>
      ${Kt(e,n)}
      <p class="small">
        Objects of the task by mass and height of their tops. The region is what the partner can pick up; circles are in
        it.
      </p>
      <p>${o.length===0?"No object of the task is beyond these limits.":"Beyond these limits:"}</p>
      <ul>
        ${o.map(({name:a,limits:l,top_m:c,mass_kg:d})=>p`<li>
            ${l.map(h=>pe[h].mark)} ${a}: ${l.map(h=>pe[h].text).join(", ")}
            (top at ${c.toFixed(2)} m, ${d.toFixed(1)} kg)
          </li>`)}
      </ul>`}};function js({agent:i,is_available:t,n_equal:e,differs_at:s}){let r=st[i];if(!t)return p`The ${r} cannot run in a page: a person, another process, or a network. Its memory is not shown. `;let n=s===null?"":` It differs at frame ${s}; nothing is shown from there on.`;return p`The ${r} runs again, and ${e} of its actions equal the recorded ones.${n} `}function Ns(i,t){let{agent:e,objects:s,people:r,path_m:n,plan:o,seen_m2:a,is_belief_equal:l}=i,c=s.filter(m=>(m.wanted??0)>=it),d=m=>m.length>0?m.join(", "):"none",h=r.map(([m,,f])=>`${m} at ${y(f,t)}`);return p`<p>
    <b>The ${st[e]}</b>, at its decision in frame ${i.frame}: has seen ${a.toFixed(0)} m². Plan:
    ${o||"none"}${n>0?`, along a path of ${n.toFixed(1)} m`:""}. Last saw people: ${d(h)}.
    ${c.length>0?p`Probably wanted: ${d(c.map(m=>m.name))}.`:u}
    ${l===null?u:l?"Its belief equals the recorded one.":"Its belief differs from the recorded one."}
    <br />Remembers ${s.length} objects: ${d(s.map(m=>m.name))}.
  </p>`}function tt(i,t,e=[]){i.setLineDash([]),i.strokeStyle=rt,i.lineWidth=.007,i.stroke(),i.setLineDash(e),i.strokeStyle=t,i.lineWidth=.0045,i.stroke(),i.setLineDash([])}function Us(i,{agent:t,path:e}){let s=e.at(-1);s&&(i.beginPath(),e.forEach(([r,n])=>i.lineTo(r,n)),tt(i,et[t],t===Oe?[.016,.009]:[]),i.beginPath(),i.arc(s[0],s[1],.009,0,2*Math.PI),i.fillStyle=et[t],i.fill())}function qs(i,{agent:t,frame:e,objects:s,people:r}){let o=et[t];for(let{at:a,last_seen:l,wanted:c}of s){let[d,h]=a;i.beginPath(),t===Oe?i.rect(d-.02/2,h-.02/2,.02,.02):i.arc(d,h,.02/2,0,2*Math.PI),(c??0)>=it&&(i.fillStyle=o,i.fill()),tt(i,o,l===e?[]:[.006,.005])}for(let[a,[l,c]]of r){i.beginPath();for(let[d,h]of[[0,-.02],[.02,0],[0,.02],[-.02,0]])i.lineTo(l+d,c+h);i.closePath(),tt(i,o),Yt(i,[l-.008,c],a.slice(0,1).toUpperCase(),o)}}function Yt(i,[t,e],s,r){let{a:n}=i.getTransform();i.save(),i.setTransform(1,0,0,1,0,0),i.font=`bold ${Math.max(11,.026*n).toFixed(0)}px sans-serif`,i.textBaseline="middle",i.lineJoin="round",i.lineWidth=.008*n,i.strokeStyle=rt,i.strokeText(s,t*n,e*n),i.fillStyle=r,i.fillText(s,t*n,e*n),i.restore()}var Bs=5,k=class extends S{constructor(){super();this.workerSource="";this.start=0;this.layers=new He(this,()=>this.chooseLayers());this.isRerunning=!1;this.playback=new K(this,e=>this.moved(e),()=>this.player?.isDrawing??!0);new J(this,()=>this.player?.seek(this.frame))}static{this.styles=X}disconnectedCallback(){super.disconnectedCallback(),this.player?.close(),this.player=void 0}updated(e){e.has("source")&&this.source&&this.open(this.source)}seek(e){this.info?.is_complete||(this.start=e),this.playback.seek(e)}get frame(){return this.playback.frame}open(e){this.player?.close(),this.info=this.shown=this.problem=void 0,this.isRerunning=!1,this.layers.reset(),this.playback.reset();let s=a=>{if(this.info=a,!a.is_complete){this.updateComplete.then(()=>this.player?.seek(0));return}this.problem=a.problem??void 0;let l=a.timeline.story.map(c=>c.frame);this.playback.reset({last:a.last_frame,perSecond:a.frames_per_second,events:l}),this.updateComplete.then(()=>{this.seek(this.start),this.chooseLayers()})},r=a=>{this.problem=a},n=a=>this.draw(a),o=()=>({agents:nt(this.info).map(a=>a.id),viewPx:O(this.viewCanvases[0],I.view),mapPx:O(this.mapCanvas,I.map),memories:this.layers.memories,withLimits:this.layers.withLimits});this.player=new G(this.workerSource,e,o,s,n,r)}moved(e){this.player?.seek(e),this.dispatchEvent(new CustomEvent("moved",{detail:e}))}draw({state:e,views:s,map:r,layers:n}){this.shown=e,s.forEach((o,a)=>F(this.viewCanvases[a],o)),!(!r||!this.info)&&(Se(this.mapCanvas,r),this.layers.draw(this.layerCanvas,r,this.info.map_height,n))}chooseLayers(){let{player:e,layers:s}=this;e?.seek(this.frame),!(!e||this.isRerunning||s.memories.length===0)&&(this.isRerunning=!0,e.rerun(r=>{s.advanced(r,this.frame)&&e.seek(this.frame)}))}render(){let{info:e}=this,s=this.problem?u:p`<p role="status">Verifying ...</p>`;return e?p`<section aria-label="Replay" @keydown=${r=>this.playback.press(r)}>
      ${this.heading(e)} ${this.pictures(e)}
      ${e.is_complete?this.details(e):s}
    </section>`:p`<p role="status">${this.problem?`Cannot show this replay: ${this.problem}`:"Replaying ..."}</p>`}details(e){return p`${ke(this.playback,e.last_frame,e.frames_per_second,this.status(e))}
      ${this.layers.choice(e)} ${this.layers.words(e)}
      ${Te(e,this.frame,s=>this.seek(s))} ${zs()} ${this.seats(e)}
      <div class="columns">${this.story(e)} ${this.belief(this.shown?.belief)}</div>
      ${Vt(this.source?.language??[],e,this.frame,s=>this.seek(s))}`}heading(e){let s=e.agents[0],r=e.timeline.deliveries.at(-1)?.done??0,n=e.helper==="none"?"Nobody helps":`The helper ${e.helper} helps`;return p`<header>
      <h2>${e.task}: the partner (${s?.person??""}) wants ${e.goal.join(", ")}</h2>
      <p>
        ${n}${e.is_complete?`; ${P(r,e.total,e.unit)}`:""}. ${Fs(e)} ${Ws(e)}
        ${e.is_complete?xe(e):u}
      </p>
      ${this.problem?p`<p class="problem" role="alert">
            ${this.problem===e.problem?`Shown up to frame ${e.last_frame} of ${e.length}`:"Cannot show other frames"}:
            ${this.problem}
          </p>`:u}
      <p class="small">${e.episode}, helper ${e.helper}, seed ${e.seed}, chaic ${e.chaic}</p>
    </header>`}pictures(e){let s=o=>this.shown?.detected[o]??[],r=o=>{let a=this.shown?.captions[o];if(!a)return u;let l=a.last_observed?p`<br />Recognized: ${a.last_observed}`:u,c=s(o).map(h=>h.label),d=c.length>0?p`<br />Detects: ${c.join(", ")}`:u;return p`<b>${a.agent}</b>: ${a.action}<br />Plan: ${a.plan||"none"}${l}${d}`},n=({label:o,at:[a,l]})=>p`<span
        class="detected ${a>.75?"before":""}"
        style="left: ${100*a}%; top: clamp(0.5rem, ${100*l}%, 100% - 0.5rem)"
        >${o}</span
      >`;return p`<div class="pictures">
      ${nt(e).map(o=>p`<figure class="a${o.id}">
          <div class="overlaid">
            <canvas class="view" width="384" height="384" role="img" aria-label="View of the ${o.name}"></canvas>
            <div aria-hidden="true">${s(o.id).map(n)}</div>
          </div>
          <figcaption>${r(o.id)}</figcaption>
        </figure>`)}
      <figure>
        <div class="overlaid">
          <canvas class="map" width="480" height="480" role="img" aria-label="Map of the place with both agents"></canvas>
          <canvas class="layers" aria-hidden="true"></canvas>
        </div>
        <figcaption>Map${this.shown?.belief?"; ring: believed position of the partner":""}</figcaption>
      </figure>
    </div>`}seats(e){let s=n=>{this.playback.seek(this.frame),this.dispatchEvent(new CustomEvent("take-over",{detail:{frame:this.frame,seat:n,seed:e.seed}}))},r=()=>{this.playback.seek(this.frame);let n=this.successor?.value??"";this.dispatchEvent(new CustomEvent("go-on",{detail:{frame:this.frame,helper:n}}))};return this.problem?u:p`<p class="seats">
      Take over from here as the
      ${nt(e).map(({id:n,name:o})=>p`<button type="button" class="link" @click=${()=>s(n)}>${o}</button> `)}
      ${e.successors.length>0?p`or let another helper go on:
            <select class="successor" aria-label="Helper that takes over">
              ${e.successors.map(n=>p`<option ?selected=${n==="oracle"}>${n}</option>`)}
            </select>
            <button type="button" ?disabled=${this.frame>=e.last_frame} @click=${r}>Go on and compare</button>`:u}
    </p>`}status(e){return P(this.shown?.done??0,e.total,e.unit)}story(e){let{story:s}=e.timeline,r=At(s,this.frame);return p`<div class="story">
      <h3>Events</h3>
      ${s.length===0?p`<p>None.</p>`:u}
      <ol>
        ${s.map((n,o)=>p`<li>
            <button
              type="button"
              aria-current=${o===r?"step":"false"}
              @click=${()=>this.seek(n.frame)}
            >
              <span class="time">${y(n.frame,e.frames_per_second)}</span> ${n.text}
            </button>
          </li>`)}
      </ol>
    </div>`}belief(e){if(!e)return u;let s=(r,n)=>p`<table>
      <caption>${r}</caption>
      ${[...n].sort((o,a)=>a[1]-o[1]).slice(0,Bs).map(([o,a])=>p`<tr>
            <th scope="row">${o}</th>
            <td><meter min="0" max="1000" .value=${a} aria-label=${o}></meter></td>
            <td class="number">${Math.round(a/10)} %</td>
          </tr>`)}
    </table>`;return p`<div class="belief">
      <h3>What the helper believes</h3>
      ${s("Goal",e.goals)} ${s("Person",e.people)}
      ${e.evidence?.length?p`<p>Saw: ${e.evidence.at(-1)}</p>`:u}
    </div>`}};v([x({attribute:!1})],k.prototype,"source",2),v([x({attribute:!1})],k.prototype,"workerSource",2),v([x({type:Number})],k.prototype,"start",2),v([$()],k.prototype,"info",2),v([$()],k.prototype,"shown",2),v([$()],k.prototype,"problem",2),v([_e("canvas.view")],k.prototype,"viewCanvases",2),v([L("canvas.map")],k.prototype,"mapCanvas",2),v([L("select.successor")],k.prototype,"successor",2),v([L("canvas.layers")],k.prototype,"layerCanvas",2);function nt(i){return i?.agents.filter(t=>t.id<2)??[]}function Fs(i){let t=i.agents[0];if(!t)return"";let[e,s]=t.reach_m.map(r=>r.toFixed(2));return`The partner reaches from ${e} to ${s} m and lifts ${t.strength_kg.toFixed(0)} kg.`}function Ws({branch_at:i,frames_per_second:t}){return i===null?"":`It continues another replay from ${y(i,t)} on.`}function zs(){return p`<p class="legend">
    <span class="key walk"></span> walks <span class="key interact"></span> uses its hands
    <span class="key failed"></span> failed (×) <span class="key wait"></span> waits
    <span class="key triangle">▼</span> delivery
  </p>`}customElements.define("chaic-replay",k);function Jt(i,t){let e=i.cells[t]?.textContent?.trim()??"",s=/^-?\d+(\.\d+)?/.exec(e);return s?Number(s[0]):e}function Vs(i,t){return typeof i=="number"&&typeof t=="number"?i-t:typeof i==typeof t?String(i).localeCompare(String(t)):typeof i=="number"?-1:1}function Zt(i){let t=i.tBodies[0],e=[...i.tHead?.rows[0]?.cells??[]];if(t)for(let s of e.filter(r=>r.tagName==="TH")){let r=document.createElement("button");r.type="button",r.textContent=s.textContent,r.addEventListener("click",()=>{let n=s.ariaSort==="ascending";e.forEach(c=>c.ariaSort=null),s.ariaSort=n?"descending":"ascending";let o=n?-1:1,a=s.cellIndex,l=[...t.rows].sort((c,d)=>o*Vs(Jt(c,a),Jt(d,a)));t.append(...l)}),s.replaceChildren(r)}}function es(){let[,i,t,e]=/^#(\d+)(?:\+(\d+))?@(\d+)$/.exec(location.hash)??[];return{replay:Number(i??0),other:t===void 0?void 0:Number(t),frame:Number(e??0)}}function Qt(i){location.protocol!=="about:"&&history.replaceState(null,"",`#${i}`)}var De=new TextEncoder,at=class{constructor(t,e,s,r){this.contents=t;this.choice=e;this.other=s;this.player=r;this.pending=0;let n=(o,a)=>{this.show({replay:Number(e.value),other:a,frame:o})};e.addEventListener("change",()=>n(0)),s.addEventListener("change",()=>{n(this.element?.frame??0,s.value===""?void 0:Number(s.value))}),addEventListener("hashchange",()=>{this.show(es()),e.scrollIntoView()})}async show(t){let e=[t.replay,t.other].filter(l=>l!==void 0).map(l=>this.contents[l]);if(!e.every(l=>l!==void 0)){this.contents.length>0&&await this.show({replay:0,frame:0});return}let s=this.isChosen(t);if(this.shown=t,s){this.element?.seek(t.frame);return}this.select(t);let r;try{r=await Promise.all(e.map(l=>this.source(l)))}catch(l){throw this.isChosen(t)&&this.clear(),l}if(!this.isChosen(t))return;rs("");let[n,o]=r,a={workerSource:Z(),start:this.shown.frame};if(o){let l=document.createElement("chaic-compare");this.element=Object.assign(l,{sources:[n,o],...a})}else this.element=ct(n,this.shown.frame);this.element.addEventListener("moved",l=>this.moved(l.detail)),this.player.replaceChildren(this.element)}showOther(t){this.clear(),this.choice.selectedIndex=-1,this.other.replaceChildren(),this.other.disabled=!0,this.player.replaceChildren(t),Qt("")}clear(){clearTimeout(this.pending),this.shown=void 0,this.element=void 0,this.player.replaceChildren()}isChosen({replay:t,other:e}){return this.shown?.replay===t&&this.shown.other===e}async source(t){let{trace:e,episode:s,language:r}=JSON.parse(new TextDecoder().decode(await Ce(t)));return{module:await Ye(),trace:De.encode(e),episode:De.encode(s),language:r}}select({replay:t,other:e}){this.choice.value=String(t);let s=[...this.choice.options],r=s[t]?.dataset.place,n=s.filter((o,a)=>a!==t&&o.dataset.place===r);this.other.replaceChildren(new Option("nothing",""),...n.map(o=>new Option(o.text,o.value))),this.other.value=e===void 0?"":String(e),this.other.disabled=n.length===0}moved(t){clearTimeout(this.pending);let{replay:e,other:s}=this.shown,r=s===void 0?e:`${e}+${s}`;this.pending=window.setTimeout(()=>Qt(`${r}@${t}`),300)}},je,ot=new AbortController;function ts(){return ot.abort(),ot=new AbortController,ot.signal}function ct(i,t){let e=document.createElement("chaic-replay");return e.addEventListener("take-over",s=>{let{frame:r,seat:n,seed:o}=s.detail,a={seed:o,seat:n,level:"plans",helper:"none"};ss(i.episode,a,{isLive:!1,speed:1},{trace:i.trace,frame:r})}),e.addEventListener("go-on",s=>{let{frame:r,helper:n}=s.detail;Ks(i,r,n)}),Object.assign(e,{source:i,workerSource:Z(),start:t})}async function Ks(i,t,e){let s=document.getElementById("play"),r=document.getElementById("player").firstElementChild,n=document.createElement("p");n.setAttribute("role","status"),n.textContent=`The helper ${e} goes on ...`,s.replaceChildren(n);let{module:o,trace:a,episode:l}=i,c=ts(),d={type:"continue",module:o,trace:a,episode:l,frame:t,helper:e},h=await Lt(Z(),d,c);if(!h||!n.isConnected)return;if(h.type!=="trace"){n.textContent=`The helper ${e} cannot go on: ${h.type==="error"?h.message:h.type}`;return}let{trace:m}=h;n.textContent=`The helper ${e} went on.`;let f={...i,trace:De.encode(m),language:[]};if(s.append(Je(m,()=>lt(ct(f,t)))),document.getElementById("player").firstElementChild!==r)return;let g=document.createElement("chaic-compare");lt(Object.assign(g,{sources:[i,f],workerSource:Z(),start:t}))}function lt(i){je?je.showOther(i):document.getElementById("player").replaceChildren(i),i.scrollIntoView()}async function ss(i,t,e,s){let r=document.getElementById("play");ts();let n=await Ye(),o=({trace:a})=>{lt(ct({module:n,trace:De.encode(a),episode:i,language:[]},0))};await zt(r,{module:n,workerSource:Z(),episode:i,config:t,pace:e,branch:s},o),r.scrollIntoView()}function Gs(i){let t=[...document.querySelectorAll("script.chaic-episode")];i.addEventListener("submit",e=>{e.preventDefault();let s=new FormData(i),r=c=>String(s.get(c)),n=t[Number(r("episode"))];if(!n)return;let o=r("level"),a={seed:0,seat:Number(r("seat")),level:o,helper:r("helper")},l={isLive:r("pace")==="live",speed:Number(r("speed"))};Ce(n).then(c=>ss(new Uint8Array(c),a,l))})}async function Xs(){let i=document.querySelector("#game");i&&Gs(i),document.querySelectorAll("table.sortable").forEach(Zt);let t=[...document.querySelectorAll("script.chaic-replay")],e=document.querySelector("#choice"),s=document.querySelector("#other"),r=document.querySelector("#player");!e||!s||!r||(je=new at(t,e,s,r),await je.show(es()))}function rs(i){let t=document.querySelector("[data-status]");t&&(t.textContent=i)}function is(i){let t=document.querySelector("#game")?"play":"show the replays";rs(`Cannot ${t}: ${String(i)}`)}addEventListener("unhandledrejection",i=>is(i.reason));Xs().catch(is);})();
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
