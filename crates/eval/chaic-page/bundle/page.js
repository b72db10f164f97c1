"use strict";(()=>{var Be=Object.defineProperty;var qe=Object.getOwnPropertyDescriptor;var g=(i,e,t,s)=>{for(var r=s>1?void 0:s?qe(e,t):e,n=i.length-1,o;n>=0;n--)(o=i[n])&&(r=(s?o(e,t,r):o(r))||r);return s&&r&&Be(e,t,r),r};var j=globalThis,B=j.ShadowRoot&&(j.ShadyCSS===void 0||j.ShadyCSS.nativeShadow)&&"adoptedStyleSheets"in Document.prototype&&"replace"in CSSStyleSheet.prototype,X=Symbol(),ae=new WeakMap,R=class{constructor(e,t,s){if(this._$cssResult$=!0,s!==X)throw Error("CSSResult is not constructable. Use `unsafeCSS` or `css` instead.");this.cssText=e,this.t=t}get styleSheet(){let e=this.o,t=this.t;if(B&&e===void 0){let s=t!==void 0&&t.length===1;s&&(e=ae.get(t)),e===void 0&&((this.o=e=new CSSStyleSheet).replaceSync(this.cssText),s&&ae.set(t,e))}return e}toString(){return this.cssText}},le=i=>new R(typeof i=="string"?i:i+"",void 0,X),J=(i,...e)=>{let t=i.length===1?i[0]:e.reduce((s,r,n)=>s+(o=>{if(o._$cssResult$===!0)return o.cssText;if(typeof o=="number")return o;throw Error("Value passed to 'css' function must be a 'css' function result: "+o+". Use 'unsafeCSS' to pass non-literal values, but take care to ensure page security.")})(r)+i[n+1],i[0]);return new R(t,i,X)},he=(i,e)=>{if(B)i.adoptedStyleSheets=e.map(t=>t instanceof CSSStyleSheet?t:t.styleSheet);else for(let t of e){let s=document.createElement("style"),r=j.litNonce;r!==void 0&&s.setAttribute("nonce",r),s.textContent=t.cssText,i.appendChild(s)}},Y=B?i=>i:i=>i instanceof CSSStyleSheet?(e=>{let t="";for(let s of e.cssRules)t+=s.cssText;return le(t)})(i):i;var{is:Fe,defineProperty:We,getOwnPropertyDescriptor:Ve,getOwnPropertyNames:Ke,getOwnPropertySymbols:Xe,getPrototypeOf:Je}=Object,q=globalThis,ce=q.trustedTypes,Ye=ce?ce.emptyScript:"",Ze=q.reactiveElementPolyfillSupport,O=(i,e)=>i,U={toAttribute(i,e){switch(e){case Boolean:i=i?Ye:null;break;case Object:case Array:i=i==null?i:JSON.stringify(i)}return i},fromAttribute(i,e){let t=i;switch(e){case Boolean:t=i!==null;break;case Number:t=i===null?null:Number(i);break;case Object:case Array:try{t=JSON.parse(i)}catch{t=null}}return t}},F=(i,e)=>!Fe(i,e),pe={attribute:!0,type:String,converter:U,reflect:!1,useDefault:!1,hasChanged:F};Symbol.metadata??=Symbol("metadata"),q.litPropertyMetadata??=new WeakMap;var $=class extends HTMLElement{static addInitializer(e){this._$Ei(),(this.l??=[]).push(e)}static get observedAttributes(){return this.finalize(),this._$Eh&&[...this._$Eh.keys()]}static createProperty(e,t=pe){if(t.state&&(t.attribute=!1),this._$Ei(),this.prototype.hasOwnProperty(e)&&((t=Object.create(t)).wrapped=!0),this.elementProperties.set(e,t),!t.noAccessor){let s=Symbol(),r=this.getPropertyDescriptor(e,s,t);r!==void 0&&We(this.prototype,e,r)}}static getPropertyDescriptor(e,t,s){let{get:r,set:n}=Ve(this.prototype,e)??{get(){return this[t]},set(o){this[t]=o}};return{get:r,set(o){let l=r?.call(this);n?.call(this,o),this.requestUpdate(e,l,s)},configurable:!0,enumerable:!0}}static getPropertyOptions(e){return this.elementProperties.get(e)??pe}static _$Ei(){if(this.hasOwnProperty(O("elementProperties")))return;let e=Je(this);e.finalize(),e.l!==void 0&&(this.l=[...e.l]),this.elementProperties=new Map(e.elementProperties)}static finalize(){if(this.hasOwnProperty(O("finalized")))return;if(this.finalized=!0,this._$Ei(),this.hasOwnProperty(O("properties"))){let t=this.properties,s=[...Ke(t),...Xe(t)];for(let r of s)this.createProperty(r,t[r])}let e=this[Symbol.metadata];if(e!==null){let t=litPropertyMetadata.get(e);if(t!==void 0)for(let[s,r]of t)this.elementProperties.set(s,r)}this._$Eh=new Map;for(let[t,s]of this.elementProperties){let r=this._$Eu(t,s);r!==void 0&&this._$Eh.set(r,t)}this.elementStyles=this.finalizeStyles(this.styles)}static finalizeStyles(e){let t=[];if(Array.isArray(e)){let s=new Set(e.flat(1/0).reverse());for(let r of s)t.unshift(Y(r))}else e!==void 0&&t.push(Y(e));return t}static _$Eu(e,t){let s=t.attribute;return s===!1?void 0:typeof s=="string"?s:typeof e=="string"?e.toLowerCase():void 0}constructor(){super(),this._$Ep=void 0,this.isUpdatePending=!1,this.hasUpdated=!1,this._$Em=null,this._$Ev()}_$Ev(){this._$ES=new Promise(e=>this.enableUpdating=e),this._$AL=new Map,this._$E_(),this.requestUpdate(),this.constructor.l?.forEach(e=>e(this))}addController(e){(this._$EO??=new Set).add(e),this.renderRoot!==void 0&&this.isConnected&&e.hostConnected?.()}removeController(e){this._$EO?.delete(e)}_$E_(){let e=new Map,t=this.constructor.elementProperties;for(let s of t.keys())this.hasOwnProperty(s)&&(e.set(s,this[s]),delete this[s]);e.size>0&&(this._$Ep=e)}createRenderRoot(){let e=this.shadowRoot??this.attachShadow(this.constructor.shadowRootOptions);return he(e,this.constructor.elementStyles),e}connectedCallback(){this.renderRoot??=this.createRenderRoot(),this.enableUpdating(!0),this._$EO?.forEach(e=>e.hostConnected?.())}enableUpdating(e){}disconnectedCallback(){this._$EO?.forEach(e=>e.hostDisconnected?.())}attributeChangedCallback(e,t,s){this._$AK(e,s)}_$ET(e,t){let s=this.constructor.elementProperties.get(e),r=this.constructor._$Eu(e,s);if(r!==void 0&&s.reflect===!0){let n=(s.converter?.toAttribute!==void 0?s.converter:U).toAttribute(t,s.type);this._$Em=e,n==null?this.removeAttribute(r):this.setAttribute(r,n),this._$Em=null}}_$AK(e,t){let s=this.constructor,r=s._$Eh.get(e);if(r!==void 0&&this._$Em!==r){let n=s.getPropertyOptions(r),o=typeof n.converter=="function"?{fromAttribute:n.converter}:n.converter?.fromAttribute!==void 0?n.converter:U;this._$Em=r;let l=o.fromAttribute(t,n.type);this[r]=l??this._$Ej?.get(r)??l,this._$Em=null}}requestUpdate(e,t,s,r=!1,n){if(e!==void 0){let o=this.constructor;if(r===!1&&(n=this[e]),s??=o.getPropertyOptions(e),!((s.hasChanged??F)(n,t)||s.useDefault&&s.reflect&&n===this._$Ej?.get(e)&&!this.hasAttribute(o._$Eu(e,s))))return;this.C(e,t,s)}this.isUpdatePending===!1&&(this._$ES=this._$EP())}C(e,t,{useDefault:s,reflect:r,wrapped:n},o){s&&!(this._$Ej??=new Map).has(e)&&(this._$Ej.set(e,o??t??this[e]),n!==!0||o!==void 0)||(this._$AL.has(e)||(this.hasUpdated||s||(t=void 0),this._$AL.set(e,t)),r===!0&&this._$Em!==e&&(this._$Eq??=new Set).add(e))}async _$EP(){this.isUpdatePending=!0;try{await this._$ES}catch(t){Promise.reject(t)}let e=this.scheduleUpdate();return e!=null&&await e,!this.isUpdatePending}scheduleUpdate(){return this.performUpdate()}performUpdate(){if(!this.isUpdatePending)return;if(!this.hasUpdated){if(this.renderRoot??=this.createRenderRoot(),this._$Ep){for(let[r,n]of this._$Ep)this[r]=n;this._$Ep=void 0}let s=this.constructor.elementProperties;if(s.size>0)for(let[r,n]of s){let{wrapped:o}=n,l=this[r];o!==!0||this._$AL.has(r)||l===void 0||this.C(r,void 0,n,l)}}let e=!1,t=this._$AL;try{e=this.shouldUpdate(t),e?(this.willUpdate(t),this._$EO?.forEach(s=>s.hostUpdate?.()),this.update(t)):this._$EM()}catch(s){throw e=!1,this._$EM(),s}e&&this._$AE(t)}willUpdate(e){}_$AE(e){this._$EO?.forEach(t=>t.hostUpdated?.()),this.hasUpdated||(this.hasUpdated=!0,this.firstUpdated(e)),this.updated(e)}_$EM(){this._$AL=new Map,this.isUpdatePending=!1}get updateComplete(){return this.getUpdateComplete()}getUpdateComplete(){return this._$ES}shouldUpdate(e){return!0}update(e){this._$Eq&&=this._$Eq.forEach(t=>this._$ET(t,this[t])),this._$EM()}updated(e){}firstUpdated(e){}};$.elementStyles=[],$.shadowRootOptions={mode:"open"},$[O("elementProperties")]=new Map,$[O("finalized")]=new Map,Ze?.({ReactiveElement:$}),(q.reactiveElementVersions??=[]).push("2.1.2");var re=globalThis,de=i=>i,W=re.trustedTypes,ue=W?W.createPolicy("lit-html",{createHTML:i=>i}):void 0,ye="$lit$",b=`lit$${Math.random().toFixed(9).slice(2)}$`,be="?"+b,Ge=`<${be}>`,x=document,H=()=>x.createComment(""),L=i=>i===null||typeof i!="object"&&typeof i!="function",ie=Array.isArray,Qe=i=>ie(i)||typeof i?.[Symbol.iterator]=="function",Z=`[ 	
\f\r]`,N=/<(?:(!--|\/[^a-zA-Z])|(\/?[a-zA-Z][^>\s]*)|(\/?$))/g,me=/-->/g,fe=/>/g,A=RegExp(`>|${Z}(?:([^\\s"'>=/]+)(${Z}*=${Z}*(?:[^ 	
\f\r"'\`<>=]|("|')|))|$)`,"g"),ge=/'/g,ve=/"/g,_e=/^(?:script|style|textarea|title)$/i,ne=i=>(e,...t)=>({_$litType$:i,strings:e,values:t}),d=ne(1),we=ne(2),_t=ne(3),y=Symbol.for("lit-noChange"),u=Symbol.for("lit-nothing"),$e=new WeakMap,E=x.createTreeWalker(x,129);function Ae(i,e){if(!ie(i)||!i.hasOwnProperty("raw"))throw Error("invalid template strings array");return ue!==void 0?ue.createHTML(e):e}var et=(i,e)=>{let t=i.length-1,s=[],r,n=e===2?"<svg>":e===3?"<math>":"",o=N;for(let l=0;l<t;l++){let a=i[l],h,p,c=-1,f=0;for(;f<a.length&&(o.lastIndex=f,p=o.exec(a),p!==null);)f=o.lastIndex,o===N?p[1]==="!--"?o=me:p[1]!==void 0?o=fe:p[2]!==void 0?(_e.test(p[2])&&(r=RegExp("</"+p[2],"g")),o=A):p[3]!==void 0&&(o=A):o===A?p[0]===">"?(o=r??N,c=-1):p[1]===void 0?c=-2:(c=o.lastIndex-p[2].length,h=p[1],o=p[3]===void 0?A:p[3]==='"'?ve:ge):o===ve||o===ge?o=A:o===me||o===fe?o=N:(o=A,r=void 0);let v=o===A&&i[l+1].startsWith("/>")?" ":"";n+=o===N?a+Ge:c>=0?(s.push(h),a.slice(0,c)+ye+a.slice(c)+b+v):a+b+(c===-2?l:v)}return[Ae(i,n+(i[t]||"<?>")+(e===2?"</svg>":e===3?"</math>":"")),s]},z=class i{constructor({strings:e,_$litType$:t},s){let r;this.parts=[];let n=0,o=0,l=e.length-1,a=this.parts,[h,p]=et(e,t);if(this.el=i.createElement(h,s),E.currentNode=this.el.content,t===2||t===3){let c=this.el.content.firstChild;c.replaceWith(...c.childNodes)}for(;(r=E.nextNode())!==null&&a.length<l;){if(r.nodeType===1){if(r.hasAttributes())for(let c of r.getAttributeNames())if(c.endsWith(ye)){let f=p[o++],v=r.getAttribute(c).split(b),k=/([.?@])?(.*)/.exec(f);a.push({type:1,index:n,name:k[2],strings:v,ctor:k[1]==="."?Q:k[1]==="?"?ee:k[1]==="@"?te:C}),r.removeAttribute(c)}else c.startsWith(b)&&(a.push({type:6,index:n}),r.removeAttribute(c));if(_e.test(r.tagName)){let c=r.textContent.split(b),f=c.length-1;if(f>0){r.textContent=W?W.emptyScript:"";for(let v=0;v<f;v++)r.append(c[v],H()),E.nextNode(),a.push({type:2,index:++n});r.append(c[f],H())}}}else if(r.nodeType===8)if(r.data===be)a.push({type:2,index:n});else{let c=-1;for(;(c=r.data.indexOf(b,c+1))!==-1;)a.push({type:7,index:n}),c+=b.length-1}n++}}static createElement(e,t){let s=x.createElement("template");return s.innerHTML=e,s}};function P(i,e,t=i,s){if(e===y)return e;let r=s!==void 0?t._$Co?.[s]:t._$Cl,n=L(e)?void 0:e._$litDirective$;return r?.constructor!==n&&(r?._$AO?.(!1),n===void 0?r=void 0:(r=new n(i),r._$AT(i,t,s)),s!==void 0?(t._$Co??=[])[s]=r:t._$Cl=r),r!==void 0&&(e=P(i,r._$AS(i,e.values),r,s)),e}var G=class{constructor(e,t){this._$AV=[],this._$AN=void 0,this._$AD=e,this._$AM=t}get parentNode(){return this._$AM.parentNode}get _$AU(){return this._$AM._$AU}u(e){let{el:{content:t},parts:s}=this._$AD,r=(e?.creationScope??x).importNode(t,!0);E.currentNode=r;let n=E.nextNode(),o=0,l=0,a=s[0];for(;a!==void 0;){if(o===a.index){let h;a.type===2?h=new D(n,n.nextSibling,this,e):a.type===1?h=new a.ctor(n,a.name,a.strings,this,e):a.type===6&&(h=new se(n,this,e)),this._$AV.push(h),a=s[++l]}o!==a?.index&&(n=E.nextNode(),o++)}return E.currentNode=x,r}p(e){let t=0;for(let s of this._$AV)s!==void 0&&(s.strings!==void 0?(s._$AI(e,s,t),t+=s.strings.length-2):s._$AI(e[t])),t++}},D=class i{get _$AU(){return this._$AM?._$AU??this._$Cv}constructor(e,t,s,r){this.type=2,this._$AH=u,this._$AN=void 0,this._$AA=e,this._$AB=t,this._$AM=s,this.options=r,this._$Cv=r?.isConnected??!0}get parentNode(){let e=this._$AA.parentNode,t=this._$AM;return t!==void 0&&e?.nodeType===11&&(e=t.parentNode),e}get startNode(){return this._$AA}get endNode(){return this._$AB}_$AI(e,t=this){e=P(this,e,t),L(e)?e===u||e==null||e===""?(this._$AH!==u&&this._$AR(),this._$AH=u):e!==this._$AH&&e!==y&&this._(e):e._$litType$!==void 0?this.$(e):e.nodeType!==void 0?this.T(e):Qe(e)?this.k(e):this._(e)}O(e){return this._$AA.parentNode.insertBefore(e,this._$AB)}T(e){this._$AH!==e&&(this._$AR(),this._$AH=this.O(e))}_(e){this._$AH!==u&&L(this._$AH)?this._$AA.nextSibling.data=e:this.T(x.createTextNode(e)),this._$AH=e}$(e){let{values:t,_$litType$:s}=e,r=typeof s=="number"?this._$AC(e):(s.el===void 0&&(s.el=z.createElement(Ae(s.h,s.h[0]),this.options)),s);if(this._$AH?._$AD===r)this._$AH.p(t);else{let n=new G(r,this),o=n.u(this.options);n.p(t),this.T(o),this._$AH=n}}_$AC(e){let t=$e.get(e.strings);return t===void 0&&$e.set(e.strings,t=new z(e)),t}k(e){ie(this._$AH)||(this._$AH=[],this._$AR());let t=this._$AH,s,r=0;for(let n of e)r===t.length?t.push(s=new i(this.O(H()),this.O(H()),this,this.options)):s=t[r],s._$AI(n),r++;r<t.length&&(this._$AR(s&&s._$AB.nextSibling,r),t.length=r)}_$AR(e=this._$AA.nextSibling,t){for(this._$AP?.(!1,!0,t);e!==this._$AB;){let s=de(e).nextSibling;de(e).remove(),e=s}}setConnected(e){this._$AM===void 0&&(this._$Cv=e,this._$AP?.(e))}},C=class{get tagName(){return this.element.tagName}get _$AU(){return this._$AM._$AU}constructor(e,t,s,r,n){this.type=1,this._$AH=u,this._$AN=void 0,this.element=e,this.name=t,this._$AM=r,this.options=n,s.length>2||s[0]!==""||s[1]!==""?(this._$AH=Array(s.length-1).fill(new String),this.strings=s):this._$AH=u}_$AI(e,t=this,s,r){let n=this.strings,o=!1;if(n===void 0)e=P(this,e,t,0),o=!L(e)||e!==this._$AH&&e!==y,o&&(this._$AH=e);else{let l=e,a,h;for(e=n[0],a=0;a<n.length-1;a++)h=P(this,l[s+a],t,a),h===y&&(h=this._$AH[a]),o||=!L(h)||h!==this._$AH[a],h===u?e=u:e!==u&&(e+=(h??"")+n[a+1]),this._$AH[a]=h}o&&!r&&this.j(e)}j(e){e===u?this.element.removeAttribute(this.name):this.element.setAttribute(this.name,e??"")}},Q=class extends C{constructor(){super(...arguments),this.type=3}j(e){this.element[this.name]=e===u?void 0:e}},ee=class extends C{constructor(){super(...arguments),this.type=4}j(e){this.element.toggleAttribute(this.name,!!e&&e!==u)}},te=class extends C{constructor(e,t,s,r,n){super(e,t,s,r,n),this.type=5}_$AI(e,t=this){if((e=P(this,e,t,0)??u)===y)return;let s=this._$AH,r=e===u&&s!==u||e.capture!==s.capture||e.once!==s.once||e.passive!==s.passive,n=e!==u&&(s===u||r);r&&this.element.removeEventListener(this.name,this,s),n&&this.element.addEventListener(this.name,this,e),this._$AH=e}handleEvent(e){typeof this._$AH=="function"?this._$AH.call(this.options?.host??this.element,e):this._$AH.handleEvent(e)}},se=class{constructor(e,t,s){this.element=e,this.type=6,this._$AN=void 0,this._$AM=t,this.options=s}get _$AU(){return this._$AM._$AU}_$AI(e){P(this,e)}};var tt=re.litHtmlPolyfillSupport;tt?.(z,D),(re.litHtmlVersions??=[]).push("3.3.3");var Ee=(i,e,t)=>{let s=t?.renderBefore??e,r=s._$litPart$;if(r===void 0){let n=t?.renderBefore??null;s._$litPart$=r=new D(e.insertBefore(H(),n),n,void 0,t??{})}return r._$AI(i),r};var oe=globalThis,_=class extends ${constructor(){super(...arguments),this.renderOptions={host:this},this._$Do=void 0}createRenderRoot(){let e=super.createRenderRoot();return this.renderOptions.renderBefore??=e.firstChild,e}update(e){let t=this.render();this.hasUpdated||(this.renderOptions.isConnected=this.isConnected),super.update(e),this._$Do=Ee(t,this.renderRoot,this.renderOptions)}connectedCallback(){super.connectedCallback(),this._$Do?.setConnected(!0)}disconnectedCallback(){super.disconnectedCallback(),this._$Do?.setConnected(!1)}render(){return y}};_._$litElement$=!0,_.finalized=!0,oe.litElementHydrateSupport?.({LitElement:_});var st=oe.litElementPolyfillSupport;st?.({LitElement:_});(oe.litElementVersions??=[]).push("4.2.2");var rt={attribute:!0,type:String,converter:U,reflect:!1,hasChanged:F},it=(i=rt,e,t)=>{let{kind:s,metadata:r}=t,n=globalThis.litPropertyMetadata.get(r);if(n===void 0&&globalThis.litPropertyMetadata.set(r,n=new Map),s==="setter"&&((i=Object.create(i)).wrapped=!0),n.set(t.name,i),s==="accessor"){let{name:o}=t;return{set(l){let a=e.get.call(this);e.set.call(this,l),this.requestUpdate(o,a,i,!0,l)},init(l){return l!==void 0&&this.C(o,void 0,i,l),l}}}if(s==="setter"){let{name:o}=t;return function(l){let a=this[o];e.call(this,l),this.requestUpdate(o,a,i,!0,l)}}throw Error("Unsupported decorator location: "+s)};function T(i){return(e,t)=>typeof t=="object"?it(i,e,t):((s,r,n)=>{let o=r.hasOwnProperty(n);return r.constructor.createProperty(n,s),o?Object.getOwnPropertyDescriptor(r,n):void 0})(i,e,t)}function S(i){return T({...i,state:!0,attribute:!1})}var w=(i,e,t)=>(t.configurable=!0,t.enumerable=!0,Reflect.decorate&&typeof e!="object"&&Object.defineProperty(i,e,t),t);function xe(i,e){return(t,s,r)=>{let n=o=>o.renderRoot?.querySelector(i)??null;if(e){let{get:o,set:l}=typeof s=="object"?t:r??(()=>{let a=Symbol();return{get(){return this[a]},set(h){this[a]=h}}})();return w(t,s,{get(){let a=o.call(this);return a===void 0&&(a=n(this),(a!==null||this.hasUpdated)&&l.call(this,a)),a}})}return w(t,s,{get(){return n(this)}})}}var nt;function Se(i){return(e,t)=>w(e,t,{get(){return(this.renderRoot??(nt??=document.createDocumentFragment())).querySelectorAll(i)}})}function M(i,e){let t=Math.floor(i/e);return`${Math.floor(t/60)}:${String(t%60).padStart(2,"0")}`}function ke(i,e,t){let s=i.filter(r=>Math.sign(r-e)===t);if(s.length!==0)return t>0?Math.min(...s):Math.max(...s)}function Pe(i,e){let t=-1;return i.forEach((s,r)=>{s.frame<=e&&(t=r)}),t}var V=class{constructor(e,t,s,r,n,o){this.sizes=s;this.onOpened=r;this.onFrame=n;this.onError=o;this.isBusy=!1;this.agents=[];let l=URL.createObjectURL(new Blob([e],{type:"text/javascript"}));this.worker=new Worker(l),this.worker.onmessage=c=>this.receive(c.data),this.worker.onerror=c=>this.onError(c.message||"the worker has stopped"),URL.revokeObjectURL(l);let{module:a,trace:h,episode:p}=t;this.post({type:"open",module:a,trace:h,episode:p})}seek(e){this.next=e,this.drawNext()}get isDrawing(){return this.isBusy}close(){this.worker.terminate()}post(e){this.isBusy=!0,this.worker.postMessage(e)}drawNext(){if(this.isBusy||this.next===void 0||this.agents.length===0)return;let e=this.next;this.next=void 0,this.post({type:"frame",frame:e,agents:this.agents,...this.sizes()})}receive(e){this.isBusy=!1,e.type==="opened"?(this.agents=e.info.agents.map(t=>t.id).filter(t=>t<2),this.onOpened(e.info)):e.type==="frame"?this.onFrame(e):this.onError(e.message),this.drawNext()}};var Ce=J`
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
    white-space: nowrap;
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
`;var Te={ATTRIBUTE:1,CHILD:2,PROPERTY:3,BOOLEAN_ATTRIBUTE:4,EVENT:5,ELEMENT:6},Me=i=>(...e)=>({_$litDirective$:i,values:e}),K=class{constructor(e){}get _$AU(){return this._$AM._$AU}_$AT(e,t,s){this._$Ct=e,this._$AM=t,this._$Ci=s}_$AS(e,t){return this.update(e,t)}update(e,t){return this.render(...t)}};var Re="important",ot=" !"+Re,I=Me(class extends K{constructor(i){if(super(i),i.type!==Te.ATTRIBUTE||i.name!=="style"||i.strings?.length>2)throw Error("The `styleMap` directive must be used in the `style` attribute and must be the only part in the attribute.")}render(i){return Object.keys(i).reduce((e,t)=>{let s=i[t];return s==null?e:e+`${t=t.includes("-")?t:t.replace(/(?:^(webkit|moz|ms|o)|)(?=[A-Z])/g,"-$&").toLowerCase()}:${s};`},"")}update(i,[e]){let{style:t}=i.element;if(this.ft===void 0)return this.ft=new Set(Object.keys(e)),this.render(e);for(let s of this.ft)e[s]==null&&(this.ft.delete(s),s.includes("-")?t.removeProperty(s):t[s]=null);for(let s in e){let r=e[s];if(r!=null){this.ft.add(s);let n=typeof r=="string"&&r.endsWith(ot);s.includes("-")||n?t.setProperty(s,n?r.slice(0,-11):r,n?Re:""):t[s]=r}}return y}});function Oe(i,e,t){let{activities:s,deliveries:r}=i.timeline,n=a=>`${(100*a/Math.max(i.length,1)).toFixed(3)}%`,o=a=>{let h=a.currentTarget.getBoundingClientRect();t((a.clientX-h.left)/h.width*i.length)},l=a=>{let h=a.failed&&a.kind==="interact",p={left:n(a.start),width:n(a.end-a.start)},c=h?"failed":a.kind,f=h?d`<span class="mark" style=${I({left:n(a.end)})}>×</span>`:"";return d`<span class="bar ${c}" style=${I(p)}></span>${f}`};return d`<div class="timeline" aria-hidden="true">
    <div class="labels">
      <span>deliveries</span>
      ${i.agents.map(a=>d`<span>${a.name}</span>`)}
    </div>
    <div
      class="rows"
      @pointerdown=${o}
      @pointermove=${a=>a.buttons===1&&o(a)}
    >
      <div class="row">
        ${r.map(({frame:a,by:h})=>d`<span class="mark a${h}" style=${I({left:n(a)})}>▼</span>`)}
      </div>
      ${i.agents.map(({id:a})=>d`<div class="row a${a}">
          ${s.filter(h=>h.agent===a).map(l)}
        </div>`)}
      <span class="now" style=${I({left:n(e)})}></span>
    </div>
  </div>`}var at=[.5,1,2,4,8],Ue={view:512,map:720},lt={previous:"M3 3h3v14H3z M17 3v14L7 10z",back:"M15 3v14L5 10z",play:"M5 3v14l12-7z",pause:"M4 3h4v14H4z M12 3h4v14h-4z",forward:"M5 3v14l10-7z",next:"M14 3h3v14h-3z M3 3v14l10-7z"},ht=5,m=class extends _{constructor(){super(...arguments);this.workerSource="";this.start=0;this.frame=0;this.isPlaying=!1;this.speed=1;this.lastTime=0;this.position=0;this.width=0;this.resizes=new ResizeObserver(()=>{this.clientWidth!==this.width&&(this.width=this.clientWidth,this.player?.seek(this.frame))})}static{this.styles=Ce}connectedCallback(){super.connectedCallback(),this.resizes.observe(this)}disconnectedCallback(){super.disconnectedCallback(),this.resizes.disconnect(),this.isPlaying=!1,this.player?.close(),this.player=void 0}updated(t){t.has("source")&&this.source&&this.open(this.source)}seek(t){this.isPlaying=!1,this.show(t)}open(t){this.player?.close(),this.info=this.shown=this.problem=void 0,this.isPlaying=!1;let s=l=>{this.info=l,this.problem=l.problem??void 0,this.updateComplete.then(()=>this.show(this.start)),this.dispatchEvent(new CustomEvent("opened",{detail:l}))},r=l=>{this.problem=l},n=l=>this.draw(l),o=()=>({viewPx:Ne(this.viewCanvases[0],Ue.view),mapPx:Ne(this.mapCanvas,Ue.map)});this.player=new V(this.workerSource,t,o,s,n,r)}show(t){this.info&&(this.frame=Math.max(0,Math.min(Math.round(t),this.info.last_frame)),this.position=this.frame,this.player?.seek(this.frame),this.dispatchEvent(new CustomEvent("moved",{detail:this.frame})))}draw({state:t,views:s,map:r}){this.shown=t,s.forEach((n,o)=>He(this.viewCanvases[o],n)),He(this.mapCanvas,r)}toggle(){this.info&&(this.frame>=this.info.last_frame&&this.show(0),this.isPlaying=!this.isPlaying,this.lastTime=performance.now(),this.isPlaying&&requestAnimationFrame(t=>this.advance(t)))}advance(t){if(!this.isPlaying||!this.info)return;let s=Math.min(t-this.lastTime,250)/1e3;this.lastTime=t,this.position+=s*this.speed*this.info.frames_per_second;let r=Math.min(Math.floor(this.position),this.info.last_frame);r!==this.frame&&!this.player?.isDrawing&&(this.frame=r,this.player?.seek(r),this.dispatchEvent(new CustomEvent("moved",{detail:r}))),this.frame>=this.info.last_frame?this.isPlaying=!1:requestAnimationFrame(n=>this.advance(n))}jump(t){let s=this.info?.timeline.story.map(n=>n.frame)??[],r=ke(s,this.frame,t);r!==void 0&&this.seek(r)}press(t){let s=t.composedPath()[0];if(t.ctrlKey||t.altKey||t.metaKey||s.matches("select, input"))return;let r=t.shiftKey?this.info?.frames_per_second??30:1,o={" ":()=>this.toggle(),ArrowLeft:()=>this.seek(this.frame-r),ArrowRight:()=>this.seek(this.frame+r),"[":()=>this.jump(-1),"]":()=>this.jump(1),Home:()=>this.seek(0),End:()=>this.seek(this.info?.last_frame??0)}[t.key];!o||t.key===" "&&s.matches("button")||(t.preventDefault(),o())}render(){let{info:t}=this;return t?d`<section aria-label="Replay" @keydown=${s=>this.press(s)}>
      ${this.heading(t)} ${this.pictures(t)} ${this.controls(t)}
      ${Oe(t,this.frame,s=>this.seek(s))} ${pt()}
      <div class="columns">${this.story(t)} ${this.belief(this.shown?.belief)}</div>
    </section>`:d`<p role="status">${this.problem?`Cannot show this replay: ${this.problem}`:"Replaying ..."}</p>`}heading(t){let s=t.agents[0],r=t.timeline.deliveries.at(-1)?.done??0,n=t.helper==="none"?"Nobody helps":`The helper ${t.helper} helps`,o=t.n_verified===t.n_decisions&&!t.problem;return d`<header>
      <h2>${t.task}: the partner (${s?.person??""}) wants ${t.goal.join(", ")}</h2>
      <p>
        ${n}; ${r} of ${t.total} delivered. ${ct(t)}
        <span class="badge ${o?"good":"bad"}">
          ${o?"verified":"not verified"}: ${t.n_verified} of ${t.n_decisions} decisions
        </span>
      </p>
      ${this.problem?d`<p class="problem" role="alert">
            Shown up to frame ${t.last_frame} of ${t.length}: ${this.problem}
          </p>`:u}
      <p class="small">${t.episode}, helper ${t.helper}, seed ${t.seed}, chaic ${t.chaic}</p>
    </header>`}pictures(t){let s=t.agents.filter(n=>n.id<2),r=n=>{let o=this.shown?.captions[n];if(!o)return u;let l=o.last_observed?d`<br />Recognized: ${o.last_observed}`:u;return d`<b>${o.agent}</b>: ${o.action}<br />Plan: ${o.plan||"none"}${l}`};return d`<div class="pictures">
      ${s.map(n=>d`<figure class="a${n.id}">
          <canvas class="view" width="384" height="384" role="img" aria-label="View of the ${n.name}"></canvas>
          <figcaption>${r(n.id)}</figcaption>
        </figure>`)}
      <figure>
        <canvas class="map" width="480" height="480" role="img" aria-label="Map of the place with both agents"></canvas>
        <figcaption>Map${this.shown?.belief?"; ring: believed position of the partner":""}</figcaption>
      </figure>
    </div>`}controls(t){let s=t.frames_per_second,r=(l,a,h)=>d`<button type="button" aria-label=${l} title=${l} @click=${h}>
        <svg viewBox="0 0 20 20" aria-hidden="true">${we`<path d=${lt[a]}></path>`}</svg>
      </button>`,[n,o]=this.isPlaying?["Pause (space)","pause"]:["Play (space)","play"];return d`<div class="controls" role="group" aria-label="Playback">
      ${r("Previous event ([)","previous",()=>this.jump(-1))}
      ${r("Previous frame (left arrow)","back",()=>this.seek(this.frame-1))}
      ${r(n,o,()=>this.toggle())}
      ${r("Next frame (right arrow)","forward",()=>this.seek(this.frame+1))}
      ${r("Next event (])","next",()=>this.jump(1))}
      <label>
        Speed
        <select @change=${l=>this.speed=Number(l.target.value)}>
          ${at.map(l=>d`<option value=${l} ?selected=${l===this.speed}>${l}x</option>`)}
        </select>
      </label>
      <label class="seek">
        <span class="hidden">Frame</span>
        <input
          type="range"
          min="0"
          max=${t.last_frame}
          .value=${String(this.frame)}
          aria-valuetext="${M(this.frame,s)} of ${M(t.length,s)}"
          @input=${l=>this.seek(Number(l.target.value))}
        />
      </label>
      <span class="time">${M(this.frame,s)} / ${M(t.length,s)}, frame ${this.frame}</span>
      <span class="time">${this.shown?.done??0} of ${t.total} delivered</span>
    </div>`}story(t){let{story:s}=t.timeline,r=Pe(s,this.frame);return d`<div class="story">
      <h3>Events</h3>
      ${s.length===0?d`<p>None.</p>`:u}
      <ol>
        ${s.map((n,o)=>d`<li>
            <button
              type="button"
              aria-current=${o===r?"step":"false"}
              @click=${()=>this.seek(n.frame)}
            >
              <span class="time">${M(n.frame,t.frames_per_second)}</span> ${n.text}
            </button>
          </li>`)}
      </ol>
    </div>`}belief(t){if(!t)return u;let s=(r,n)=>d`<table>
      <caption>${r}</caption>
      ${[...n].sort((o,l)=>l[1]-o[1]).slice(0,ht).map(([o,l])=>d`<tr>
            <th scope="row">${o}</th>
            <td><meter min="0" max="1000" .value=${l} aria-label=${o}></meter></td>
            <td class="number">${Math.round(l/10)} %</td>
          </tr>`)}
    </table>`;return d`<div class="belief">
      <h3>What the helper believes</h3>
      ${s("Goal",t.goals)} ${s("Person",t.people)}
      ${t.evidence?.length?d`<p>Saw: ${t.evidence.at(-1)}</p>`:u}
    </div>`}};g([T({attribute:!1})],m.prototype,"source",2),g([T({attribute:!1})],m.prototype,"workerSource",2),g([T({type:Number})],m.prototype,"start",2),g([S()],m.prototype,"info",2),g([S()],m.prototype,"shown",2),g([S()],m.prototype,"frame",2),g([S()],m.prototype,"isPlaying",2),g([S()],m.prototype,"speed",2),g([S()],m.prototype,"problem",2),g([Se("canvas.view")],m.prototype,"viewCanvases",2),g([xe("canvas.map")],m.prototype,"mapCanvas",2);function ct(i){let e=i.agents[0];if(!e)return"";let[t,s]=e.reach_m.map(r=>r.toFixed(2));return`The partner reaches from ${t} to ${s} m and lifts ${e.strength_kg.toFixed(0)} kg.`}function Ne(i,e){let s=(i?.clientWidth??0)*devicePixelRatio;return Math.min(Math.max(64*Math.ceil(s/64),64),e)}function pt(){return d`<p class="legend">
    <span class="key walk"></span> walks <span class="key interact"></span> uses its hands
    <span class="key failed"></span> in vain (×) <span class="key wait"></span> waits
    <span class="key triangle">▼</span> delivery
  </p>`}function He(i,{width:e,height:t,rgba:s}){let r=i?.getContext("2d");!i||!r||((i.width!==e||i.height!==t)&&(i.width=e,i.height=t),r.putImageData(new ImageData(s,e,t),0,0))}customElements.define("chaic-replay",m);function Le(i,e){let t=i.cells[e]?.textContent?.trim()??"",s=/^-?\d+(\.\d+)?/.exec(t);return s?Number(s[0]):t}function dt(i,e){return typeof i=="number"&&typeof e=="number"?i-e:typeof i==typeof e?String(i).localeCompare(String(e)):typeof i=="number"?-1:1}function ze(i){let e=i.tBodies[0],t=[...i.tHead?.rows[0]?.cells??[]];if(e)for(let s of t.filter(r=>r.tagName==="TH")){let r=document.createElement("button");r.type="button",r.textContent=s.textContent,r.addEventListener("click",()=>{let n=s.ariaSort==="ascending";t.forEach(h=>h.ariaSort=null),s.ariaSort=n?"descending":"ascending";let o=n?-1:1,l=s.cellIndex,a=[...e.rows].sort((h,p)=>o*dt(Le(h,l),Le(p,l)));e.append(...a)}),s.replaceChildren(r)}}var ut="chaic-module",mt="chaic-worker";async function De(i){let e=Uint8Array.from(atob(i.textContent.trim()),s=>s.charCodeAt(0)),t=new Blob([e]).stream().pipeThrough(new DecompressionStream("deflate-raw"));return new Response(t).arrayBuffer()}function Ie(){let[,i,e]=/^#(\d+)@(\d+)$/.exec(location.hash)??[];return{replay:Number(i??0),frame:Number(e??0)}}async function ft(){document.querySelectorAll("table.sortable").forEach(ze);let i=[...document.querySelectorAll("script.chaic-replay")],e=document.querySelector("chaic-replay"),t=document.querySelector("#choice");if(!e||!t)return;let s=await De(document.getElementById(ut));e.workerSource=document.getElementById(mt).textContent;let r=async(a,h)=>{let p=i[a];if(!p)return;t.value=String(a);let c=JSON.parse(new TextDecoder().decode(await De(p))),f=new TextEncoder,[v,k]=[c.trace,c.episode].map(je=>f.encode(je));e.start=h,e.source={module:s,trace:v,episode:k}},n=0;e.addEventListener("moved",a=>{clearTimeout(n);let h=a.detail,p=`#${t.value}@${h}`;n=window.setTimeout(()=>history.replaceState(null,"",p),300)}),t.addEventListener("change",()=>{r(Number(t.value),0)}),addEventListener("hashchange",()=>{let{replay:a,frame:h}=Ie();String(a)===t.value?e.seek(h):r(a,h),e.scrollIntoView()});let{replay:o,frame:l}=Ie();await r(o,l)}ft().catch(i=>{let e=document.querySelector("[data-status]");e&&(e.textContent=`Cannot show the replays: ${String(i)}`)});})();
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
*/
