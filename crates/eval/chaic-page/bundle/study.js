"use strict";(()=>{var bt=Object.defineProperty;var $t=Object.getOwnPropertyDescriptor;var u=(r,t,e,i)=>{for(var s=i>1?void 0:i?$t(t,e):t,n=r.length-1,o;n>=0;n--)(o=r[n])&&(s=(i?o(t,e,s):o(s))||s);return i&&s&&bt(t,e,s),s};var X=globalThis,Q=X.ShadowRoot&&(X.ShadyCSS===void 0||X.ShadyCSS.nativeShadow)&&"adoptedStyleSheets"in Document.prototype&&"replace"in CSSStyleSheet.prototype,ge=Symbol(),Re=new WeakMap,j=class{constructor(t,e,i){if(this._$cssResult$=!0,i!==ge)throw Error("CSSResult is not constructable. Use `unsafeCSS` or `css` instead.");this.cssText=t,this.t=e}get styleSheet(){let t=this.o,e=this.t;if(Q&&t===void 0){let i=e!==void 0&&e.length===1;i&&(t=Re.get(e)),t===void 0&&((this.o=t=new CSSStyleSheet).replaceSync(this.cssText),i&&Re.set(e,t))}return t}toString(){return this.cssText}},Pe=r=>new j(typeof r=="string"?r:r+"",void 0,ge),ve=(r,...t)=>{let e=r.length===1?r[0]:t.reduce((i,s,n)=>i+(o=>{if(o._$cssResult$===!0)return o.cssText;if(typeof o=="number")return o;throw Error("Value passed to 'css' function must be a 'css' function result: "+o+". Use 'unsafeCSS' to pass non-literal values, but take care to ensure page security.")})(s)+r[n+1],r[0]);return new j(e,r,ge)},Le=(r,t)=>{if(Q)r.adoptedStyleSheets=t.map(e=>e instanceof CSSStyleSheet?e:e.styleSheet);else for(let e of t){let i=document.createElement("style"),s=X.litNonce;s!==void 0&&i.setAttribute("nonce",s),i.textContent=e.cssText,r.appendChild(i)}},ye=Q?r=>r:r=>r instanceof CSSStyleSheet?(t=>{let e="";for(let i of t.cssRules)e+=i.cssText;return Pe(e)})(r):r;var{is:wt,defineProperty:_t,getOwnPropertyDescriptor:St,getOwnPropertyNames:Et,getOwnPropertySymbols:xt,getPrototypeOf:At}=Object,Z=globalThis,Ce=Z.trustedTypes,Tt=Ce?Ce.emptyScript:"",kt=Z.reactiveElementPolyfillSupport,q=(r,t)=>r,F={toAttribute(r,t){switch(t){case Boolean:r=r?Tt:null;break;case Object:case Array:r=r==null?r:JSON.stringify(r)}return r},fromAttribute(r,t){let e=r;switch(t){case Boolean:e=r!==null;break;case Number:e=r===null?null:Number(r);break;case Object:case Array:try{e=JSON.parse(r)}catch{e=null}}return e}},ee=(r,t)=>!wt(r,t),Me={attribute:!0,type:String,converter:F,reflect:!1,useDefault:!1,hasChanged:ee};Symbol.metadata??=Symbol("metadata"),Z.litPropertyMetadata??=new WeakMap;var S=class extends HTMLElement{static addInitializer(t){this._$Ei(),(this.l??=[]).push(t)}static get observedAttributes(){return this.finalize(),this._$Eh&&[...this._$Eh.keys()]}static createProperty(t,e=Me){if(e.state&&(e.attribute=!1),this._$Ei(),this.prototype.hasOwnProperty(t)&&((e=Object.create(e)).wrapped=!0),this.elementProperties.set(t,e),!e.noAccessor){let i=Symbol(),s=this.getPropertyDescriptor(t,i,e);s!==void 0&&_t(this.prototype,t,s)}}static getPropertyDescriptor(t,e,i){let{get:s,set:n}=St(this.prototype,t)??{get(){return this[e]},set(o){this[e]=o}};return{get:s,set(o){let l=s?.call(this);n?.call(this,o),this.requestUpdate(t,l,i)},configurable:!0,enumerable:!0}}static getPropertyOptions(t){return this.elementProperties.get(t)??Me}static _$Ei(){if(this.hasOwnProperty(q("elementProperties")))return;let t=At(this);t.finalize(),t.l!==void 0&&(this.l=[...t.l]),this.elementProperties=new Map(t.elementProperties)}static finalize(){if(this.hasOwnProperty(q("finalized")))return;if(this.finalized=!0,this._$Ei(),this.hasOwnProperty(q("properties"))){let e=this.properties,i=[...Et(e),...xt(e)];for(let s of i)this.createProperty(s,e[s])}let t=this[Symbol.metadata];if(t!==null){let e=litPropertyMetadata.get(t);if(e!==void 0)for(let[i,s]of e)this.elementProperties.set(i,s)}this._$Eh=new Map;for(let[e,i]of this.elementProperties){let s=this._$Eu(e,i);s!==void 0&&this._$Eh.set(s,e)}this.elementStyles=this.finalizeStyles(this.styles)}static finalizeStyles(t){let e=[];if(Array.isArray(t)){let i=new Set(t.flat(1/0).reverse());for(let s of i)e.unshift(ye(s))}else t!==void 0&&e.push(ye(t));return e}static _$Eu(t,e){let i=e.attribute;return i===!1?void 0:typeof i=="string"?i:typeof t=="string"?t.toLowerCase():void 0}constructor(){super(),this._$Ep=void 0,this.isUpdatePending=!1,this.hasUpdated=!1,this._$Em=null,this._$Ev()}_$Ev(){this._$ES=new Promise(t=>this.enableUpdating=t),this._$AL=new Map,this._$E_(),this.requestUpdate(),this.constructor.l?.forEach(t=>t(this))}addController(t){(this._$EO??=new Set).add(t),this.renderRoot!==void 0&&this.isConnected&&t.hostConnected?.()}removeController(t){this._$EO?.delete(t)}_$E_(){let t=new Map,e=this.constructor.elementProperties;for(let i of e.keys())this.hasOwnProperty(i)&&(t.set(i,this[i]),delete this[i]);t.size>0&&(this._$Ep=t)}createRenderRoot(){let t=this.shadowRoot??this.attachShadow(this.constructor.shadowRootOptions);return Le(t,this.constructor.elementStyles),t}connectedCallback(){this.renderRoot??=this.createRenderRoot(),this.enableUpdating(!0),this._$EO?.forEach(t=>t.hostConnected?.())}enableUpdating(t){}disconnectedCallback(){this._$EO?.forEach(t=>t.hostDisconnected?.())}attributeChangedCallback(t,e,i){this._$AK(t,i)}_$ET(t,e){let i=this.constructor.elementProperties.get(t),s=this.constructor._$Eu(t,i);if(s!==void 0&&i.reflect===!0){let n=(i.converter?.toAttribute!==void 0?i.converter:F).toAttribute(e,i.type);this._$Em=t,n==null?this.removeAttribute(s):this.setAttribute(s,n),this._$Em=null}}_$AK(t,e){let i=this.constructor,s=i._$Eh.get(t);if(s!==void 0&&this._$Em!==s){let n=i.getPropertyOptions(s),o=typeof n.converter=="function"?{fromAttribute:n.converter}:n.converter?.fromAttribute!==void 0?n.converter:F;this._$Em=s;let l=o.fromAttribute(e,n.type);this[s]=l??this._$Ej?.get(s)??l,this._$Em=null}}requestUpdate(t,e,i,s=!1,n){if(t!==void 0){let o=this.constructor;if(s===!1&&(n=this[t]),i??=o.getPropertyOptions(t),!((i.hasChanged??ee)(n,e)||i.useDefault&&i.reflect&&n===this._$Ej?.get(t)&&!this.hasAttribute(o._$Eu(t,i))))return;this.C(t,e,i)}this.isUpdatePending===!1&&(this._$ES=this._$EP())}C(t,e,{useDefault:i,reflect:s,wrapped:n},o){i&&!(this._$Ej??=new Map).has(t)&&(this._$Ej.set(t,o??e??this[t]),n!==!0||o!==void 0)||(this._$AL.has(t)||(this.hasUpdated||i||(e=void 0),this._$AL.set(t,e)),s===!0&&this._$Em!==t&&(this._$Eq??=new Set).add(t))}async _$EP(){this.isUpdatePending=!0;try{await this._$ES}catch(e){Promise.reject(e)}let t=this.scheduleUpdate();return t!=null&&await t,!this.isUpdatePending}scheduleUpdate(){return this.performUpdate()}performUpdate(){if(!this.isUpdatePending)return;if(!this.hasUpdated){if(this.renderRoot??=this.createRenderRoot(),this._$Ep){for(let[s,n]of this._$Ep)this[s]=n;this._$Ep=void 0}let i=this.constructor.elementProperties;if(i.size>0)for(let[s,n]of i){let{wrapped:o}=n,l=this[s];o!==!0||this._$AL.has(s)||l===void 0||this.C(s,void 0,n,l)}}let t=!1,e=this._$AL;try{t=this.shouldUpdate(e),t?(this.willUpdate(e),this._$EO?.forEach(i=>i.hostUpdate?.()),this.update(e)):this._$EM()}catch(i){throw t=!1,this._$EM(),i}t&&this._$AE(e)}willUpdate(t){}_$AE(t){this._$EO?.forEach(e=>e.hostUpdated?.()),this.hasUpdated||(this.hasUpdated=!0,this.firstUpdated(t)),this.updated(t)}_$EM(){this._$AL=new Map,this.isUpdatePending=!1}get updateComplete(){return this.getUpdateComplete()}getUpdateComplete(){return this._$ES}shouldUpdate(t){return!0}update(t){this._$Eq&&=this._$Eq.forEach(e=>this._$ET(e,this[e])),this._$EM()}updated(t){}firstUpdated(t){}};S.elementStyles=[],S.shadowRootOptions={mode:"open"},S[q("elementProperties")]=new Map,S[q("finalized")]=new Map,kt?.({ReactiveElement:S}),(Z.reactiveElementVersions??=[]).push("2.1.2");var $e=globalThis,Oe=r=>r,te=$e.trustedTypes,De=te?te.createPolicy("lit-html",{createHTML:r=>r}):void 0,we="$lit$",E=`lit$${Math.random().toFixed(9).slice(2)}$`,_e="?"+E,Rt=`<${_e}>`,P=document,Y=()=>P.createComment(""),z=r=>r===null||typeof r!="object"&&typeof r!="function",Se=Array.isArray,je=r=>Se(r)||typeof r?.[Symbol.iterator]=="function",be=`[ 	
\f\r]`,W=/<(?:(!--|\/[^a-zA-Z])|(\/?[a-zA-Z][^>\s]*)|(\/?$))/g,Ue=/-->/g,He=/>/g,k=RegExp(`>|${be}(?:([^\\s"'>=/]+)(${be}*=${be}*(?:[^ 	
\f\r"'\`<>=]|("|')|))|$)`,"g"),Ne=/'/g,Ie=/"/g,qe=/^(?:script|style|textarea|title)$/i,Ee=r=>(t,...e)=>({_$litType$:r,strings:t,values:e}),h=Ee(1),ti=Ee(2),ii=Ee(3),x=Symbol.for("lit-noChange"),p=Symbol.for("lit-nothing"),Be=new WeakMap,R=P.createTreeWalker(P,129);function Fe(r,t){if(!Se(r)||!r.hasOwnProperty("raw"))throw Error("invalid template strings array");return De!==void 0?De.createHTML(t):t}var We=(r,t)=>{let e=r.length-1,i=[],s,n=t===2?"<svg>":t===3?"<math>":"",o=W;for(let l=0;l<e;l++){let a=r[l],d,f,c=-1,g=0;for(;g<a.length&&(o.lastIndex=g,f=o.exec(a),f!==null);)g=o.lastIndex,o===W?f[1]==="!--"?o=Ue:f[1]!==void 0?o=He:f[2]!==void 0?(qe.test(f[2])&&(s=RegExp("</"+f[2],"g")),o=k):f[3]!==void 0&&(o=k):o===k?f[0]===">"?(o=s??W,c=-1):f[1]===void 0?c=-2:(c=o.lastIndex-f[2].length,d=f[1],o=f[3]===void 0?k:f[3]==='"'?Ie:Ne):o===Ie||o===Ne?o=k:o===Ue||o===He?o=W:(o=k,s=void 0);let m=o===k&&r[l+1].startsWith("/>")?" ":"";n+=o===W?a+Rt:c>=0?(i.push(d),a.slice(0,c)+we+a.slice(c)+E+m):a+E+(c===-2?l:m)}return[Fe(r,n+(r[e]||"<?>")+(t===2?"</svg>":t===3?"</math>":"")),i]},V=class r{constructor({strings:t,_$litType$:e},i){let s;this.parts=[];let n=0,o=0,l=t.length-1,a=this.parts,[d,f]=We(t,e);if(this.el=r.createElement(d,i),R.currentNode=this.el.content,e===2||e===3){let c=this.el.content.firstChild;c.replaceWith(...c.childNodes)}for(;(s=R.nextNode())!==null&&a.length<l;){if(s.nodeType===1){if(s.hasAttributes())for(let c of s.getAttributeNames())if(c.endsWith(we)){let g=f[o++],m=s.getAttribute(c).split(E),b=/([.?@])?(.*)/.exec(g);a.push({type:1,index:n,name:b[2],strings:m,ctor:b[1]==="."?se:b[1]==="?"?re:b[1]==="@"?ne:C}),s.removeAttribute(c)}else c.startsWith(E)&&(a.push({type:6,index:n}),s.removeAttribute(c));if(qe.test(s.tagName)){let c=s.textContent.split(E),g=c.length-1;if(g>0){s.textContent=te?te.emptyScript:"";for(let m=0;m<g;m++)s.append(c[m],Y()),R.nextNode(),a.push({type:2,index:++n});s.append(c[g],Y())}}}else if(s.nodeType===8)if(s.data===_e)a.push({type:2,index:n});else{let c=-1;for(;(c=s.data.indexOf(E,c+1))!==-1;)a.push({type:7,index:n}),c+=E.length-1}n++}}static createElement(t,e){let i=P.createElement("template");return i.innerHTML=t,i}};function L(r,t,e=r,i){if(t===x)return t;let s=i!==void 0?e._$Co?.[i]:e._$Cl,n=z(t)?void 0:t._$litDirective$;return s?.constructor!==n&&(s?._$AO?.(!1),n===void 0?s=void 0:(s=new n(r),s._$AT(r,e,i)),i!==void 0?(e._$Co??=[])[i]=s:e._$Cl=s),s!==void 0&&(t=L(r,s._$AS(r,t.values),s,i)),t}var ie=class{constructor(t,e){this._$AV=[],this._$AN=void 0,this._$AD=t,this._$AM=e}get parentNode(){return this._$AM.parentNode}get _$AU(){return this._$AM._$AU}u(t){let{el:{content:e},parts:i}=this._$AD,s=(t?.creationScope??P).importNode(e,!0);R.currentNode=s;let n=R.nextNode(),o=0,l=0,a=i[0];for(;a!==void 0;){if(o===a.index){let d;a.type===2?d=new D(n,n.nextSibling,this,t):a.type===1?d=new a.ctor(n,a.name,a.strings,this,t):a.type===6&&(d=new oe(n,this,t)),this._$AV.push(d),a=i[++l]}o!==a?.index&&(n=R.nextNode(),o++)}return R.currentNode=P,s}p(t){let e=0;for(let i of this._$AV)i!==void 0&&(i.strings!==void 0?(i._$AI(t,i,e),e+=i.strings.length-2):i._$AI(t[e])),e++}},D=class r{get _$AU(){return this._$AM?._$AU??this._$Cv}constructor(t,e,i,s){this.type=2,this._$AH=p,this._$AN=void 0,this._$AA=t,this._$AB=e,this._$AM=i,this.options=s,this._$Cv=s?.isConnected??!0}get parentNode(){let t=this._$AA.parentNode,e=this._$AM;return e!==void 0&&t?.nodeType===11&&(t=e.parentNode),t}get startNode(){return this._$AA}get endNode(){return this._$AB}_$AI(t,e=this){t=L(this,t,e),z(t)?t===p||t==null||t===""?(this._$AH!==p&&this._$AR(),this._$AH=p):t!==this._$AH&&t!==x&&this._(t):t._$litType$!==void 0?this.$(t):t.nodeType!==void 0?this.T(t):je(t)?this.k(t):this._(t)}O(t){return this._$AA.parentNode.insertBefore(t,this._$AB)}T(t){this._$AH!==t&&(this._$AR(),this._$AH=this.O(t))}_(t){this._$AH!==p&&z(this._$AH)?this._$AA.nextSibling.data=t:this.T(P.createTextNode(t)),this._$AH=t}$(t){let{values:e,_$litType$:i}=t,s=typeof i=="number"?this._$AC(t):(i.el===void 0&&(i.el=V.createElement(Fe(i.h,i.h[0]),this.options)),i);if(this._$AH?._$AD===s)this._$AH.p(e);else{let n=new ie(s,this),o=n.u(this.options);n.p(e),this.T(o),this._$AH=n}}_$AC(t){let e=Be.get(t.strings);return e===void 0&&Be.set(t.strings,e=new V(t)),e}k(t){Se(this._$AH)||(this._$AH=[],this._$AR());let e=this._$AH,i,s=0;for(let n of t)s===e.length?e.push(i=new r(this.O(Y()),this.O(Y()),this,this.options)):i=e[s],i._$AI(n),s++;s<e.length&&(this._$AR(i&&i._$AB.nextSibling,s),e.length=s)}_$AR(t=this._$AA.nextSibling,e){for(this._$AP?.(!1,!0,e);t!==this._$AB;){let i=Oe(t).nextSibling;Oe(t).remove(),t=i}}setConnected(t){this._$AM===void 0&&(this._$Cv=t,this._$AP?.(t))}},C=class{get tagName(){return this.element.tagName}get _$AU(){return this._$AM._$AU}constructor(t,e,i,s,n){this.type=1,this._$AH=p,this._$AN=void 0,this.element=t,this.name=e,this._$AM=s,this.options=n,i.length>2||i[0]!==""||i[1]!==""?(this._$AH=Array(i.length-1).fill(new String),this.strings=i):this._$AH=p}_$AI(t,e=this,i,s){let n=this.strings,o=!1;if(n===void 0)t=L(this,t,e,0),o=!z(t)||t!==this._$AH&&t!==x,o&&(this._$AH=t);else{let l=t,a,d;for(t=n[0],a=0;a<n.length-1;a++)d=L(this,l[i+a],e,a),d===x&&(d=this._$AH[a]),o||=!z(d)||d!==this._$AH[a],d===p?t=p:t!==p&&(t+=(d??"")+n[a+1]),this._$AH[a]=d}o&&!s&&this.j(t)}j(t){t===p?this.element.removeAttribute(this.name):this.element.setAttribute(this.name,t??"")}},se=class extends C{constructor(){super(...arguments),this.type=3}j(t){this.element[this.name]=t===p?void 0:t}},re=class extends C{constructor(){super(...arguments),this.type=4}j(t){this.element.toggleAttribute(this.name,!!t&&t!==p)}},ne=class extends C{constructor(t,e,i,s,n){super(t,e,i,s,n),this.type=5}_$AI(t,e=this){if((t=L(this,t,e,0)??p)===x)return;let i=this._$AH,s=t===p&&i!==p||t.capture!==i.capture||t.once!==i.once||t.passive!==i.passive,n=t!==p&&(i===p||s);s&&this.element.removeEventListener(this.name,this,i),n&&this.element.addEventListener(this.name,this,t),this._$AH=t}handleEvent(t){typeof this._$AH=="function"?this._$AH.call(this.options?.host??this.element,t):this._$AH.handleEvent(t)}},oe=class{constructor(t,e,i){this.element=t,this.type=6,this._$AN=void 0,this._$AM=e,this.options=i}get _$AU(){return this._$AM._$AU}_$AI(t){L(this,t)}},Ye={M:we,P:E,A:_e,C:1,L:We,R:ie,D:je,V:L,I:D,H:C,N:re,U:ne,B:se,F:oe},Pt=$e.litHtmlPolyfillSupport;Pt?.(V,D),($e.litHtmlVersions??=[]).push("3.3.3");var ze=(r,t,e)=>{let i=e?.renderBefore??t,s=i._$litPart$;if(s===void 0){let n=e?.renderBefore??null;i._$litPart$=s=new D(t.insertBefore(Y(),n),n,void 0,e??{})}return s._$AI(r),s};var xe=globalThis,w=class extends S{constructor(){super(...arguments),this.renderOptions={host:this},this._$Do=void 0}createRenderRoot(){let t=super.createRenderRoot();return this.renderOptions.renderBefore??=t.firstChild,t}update(t){let e=this.render();this.hasUpdated||(this.renderOptions.isConnected=this.isConnected),super.update(t),this._$Do=ze(e,this.renderRoot,this.renderOptions)}connectedCallback(){super.connectedCallback(),this._$Do?.setConnected(!0)}disconnectedCallback(){super.disconnectedCallback(),this._$Do?.setConnected(!1)}render(){return x}};w._$litElement$=!0,w.finalized=!0,xe.litElementHydrateSupport?.({LitElement:w});var Lt=xe.litElementPolyfillSupport;Lt?.({LitElement:w});(xe.litElementVersions??=[]).push("4.2.2");var Ct={attribute:!0,type:String,converter:F,reflect:!1,hasChanged:ee},Mt=(r=Ct,t,e)=>{let{kind:i,metadata:s}=e,n=globalThis.litPropertyMetadata.get(s);if(n===void 0&&globalThis.litPropertyMetadata.set(s,n=new Map),i==="setter"&&((r=Object.create(r)).wrapped=!0),n.set(e.name,r),i==="accessor"){let{name:o}=e;return{set(l){let a=t.get.call(this);t.set.call(this,l),this.requestUpdate(o,a,r,!0,l)},init(l){return l!==void 0&&this.C(o,void 0,r,l),l}}}if(i==="setter"){let{name:o}=e;return function(l){let a=this[o];t.call(this,l),this.requestUpdate(o,a,r,!0,l)}}throw Error("Unsupported decorator location: "+i)};function A(r){return(t,e)=>typeof e=="object"?Mt(r,t,e):((i,s,n)=>{let o=s.hasOwnProperty(n);return s.constructor.createProperty(n,i),o?Object.getOwnPropertyDescriptor(s,n):void 0})(r,t,e)}function v(r){return A({...r,state:!0,attribute:!1})}var M=(r,t,e)=>(e.configurable=!0,e.enumerable=!0,Reflect.decorate&&typeof t!="object"&&Object.defineProperty(r,t,e),e);function U(r,t){return(e,i,s)=>{let n=o=>o.renderRoot?.querySelector(r)??null;if(t){let{get:o,set:l}=typeof i=="object"?e:s??(()=>{let a=Symbol();return{get(){return this[a]},set(d){this[a]=d}}})();return M(e,i,{get(){let a=o.call(this);return a===void 0&&(a=n(this),(a!==null||this.hasUpdated)&&l.call(this,a)),a}})}return M(e,i,{get(){return n(this)}})}}var Ve={ATTRIBUTE:1,CHILD:2,PROPERTY:3,BOOLEAN_ATTRIBUTE:4,EVENT:5,ELEMENT:6},ae=r=>(...t)=>({_$litDirective$:r,values:t}),H=class{constructor(t){}get _$AU(){return this._$AM._$AU}_$AT(t,e,i){this._$Ct=t,this._$AM=e,this._$Ci=i}_$AS(t,e){return this.update(t,e)}update(t,e){return this.render(...e)}};var{I:Ot}=Ye,Ke=r=>r;var Ge=()=>document.createComment(""),N=(r,t,e)=>{let i=r._$AA.parentNode,s=t===void 0?r._$AB:t._$AA;if(e===void 0){let n=i.insertBefore(Ge(),s),o=i.insertBefore(Ge(),s);e=new Ot(n,o,r,r.options)}else{let n=e._$AB.nextSibling,o=e._$AM,l=o!==r;if(l){let a;e._$AQ?.(r),e._$AM=r,e._$AP!==void 0&&(a=r._$AU)!==o._$AU&&e._$AP(a)}if(n!==s||l){let a=e._$AA;for(;a!==n;){let d=Ke(a).nextSibling;Ke(i).insertBefore(a,s),a=d}}}return e},T=(r,t,e=r)=>(r._$AI(t,e),r),Dt={},le=(r,t=Dt)=>r._$AH=t,Je=r=>r._$AH,de=r=>{r._$AR(),r._$AA.remove()};var Xe=ae(class extends H{constructor(){super(...arguments),this.key=p}render(r,t){return this.key=r,t}update(r,[t,e]){return t!==this.key&&(le(r),this.key=t),e}});async function Ae(r){let t=Uint8Array.from(atob(r.textContent.trim()),i=>i.charCodeAt(0)),e=new Blob([t]).stream().pipeThrough(new DecompressionStream("deflate-raw"));return new Response(e).arrayBuffer()}var Qe=()=>Ae(document.getElementById("chaic-module")),Ze=()=>document.getElementById("chaic-worker").textContent;var et=(r,t,e)=>{let i=new Map;for(let s=t;s<=e;s++)i.set(r[s],s);return i},tt=ae(class extends H{constructor(r){if(super(r),r.type!==Ve.CHILD)throw Error("repeat() can only be used in text expressions")}dt(r,t,e){let i;e===void 0?e=t:t!==void 0&&(i=t);let s=[],n=[],o=0;for(let l of r)s[o]=i?i(l,o):o,n[o]=e(l,o),o++;return{values:n,keys:s}}render(r,t,e){return this.dt(r,t,e).values}update(r,[t,e,i]){let s=Je(r),{values:n,keys:o}=this.dt(t,e,i);if(!Array.isArray(s))return this.ut=o,n;let l=this.ut??=[],a=[],d,f,c=0,g=s.length-1,m=0,b=n.length-1;for(;c<=g&&m<=b;)if(s[c]===null)c++;else if(s[g]===null)g--;else if(l[c]===o[m])a[m]=T(s[c],n[m]),c++,m++;else if(l[g]===o[b])a[b]=T(s[g],n[b]),g--,b--;else if(l[c]===o[b])a[b]=T(s[c],n[b]),N(r,a[b+1],s[c]),c++,b--;else if(l[g]===o[m])a[m]=T(s[g],n[m]),N(r,s[c],s[g]),g--,m++;else if(d===void 0&&(d=et(o,m,b),f=et(l,c,g)),d.has(l[c]))if(d.has(l[g])){let _=f.get(o[m]),fe=_!==void 0?s[_]:null;if(fe===null){let ke=N(r,s[c]);T(ke,n[m]),a[m]=ke}else a[m]=T(fe,n[m]),N(r,s[c],fe),s[_]=null;m++}else de(s[g]),g--;else de(s[c]),c++;for(;m<=b;){let _=N(r,a[b+1]);T(_,n[m]),a[m++]=_}for(;c<=g;){let _=s[c++];_!==null&&de(_)}return this.ut=o,le(r,a),x}});function it(r,t){let e=Math.floor(r/t);return`${Math.floor(e/60)}:${String(e%60).padStart(2,"0")}`}function st(r,t,e){return`${r} of ${t}${e&&` ${e}`} delivered`}var rt={view:512,map:720};function nt(r,t){let i=(r?.clientWidth??0)*devicePixelRatio;return Math.min(Math.max(64*Math.ceil(i/64),64),t)}function ot(r,{width:t,height:e,rgba:i}){let s=r?.getContext("2d");!r||!s||((r.width!==t||r.height!==e)&&(r.width=t,r.height=e),s.putImageData(new ImageData(i,t,e),0,0))}var Ut=[1,1.5,2.5,4],Ht=1.5,I=class{constructor(t,e){this.host=t;this.choices=e;this.timer=0;this.isOn=!1;this.seconds=Ht}stop(){this.set(!1)}controls(t){let e=s=>this.set(s.target.checked),i=s=>{this.seconds=Number(s.target.value),this.set(this.isOn),s.target.blur()};return h`<label>
        <input type="checkbox" class="scan" .checked=${this.isOn} @change=${e} />
        ${t}
      </label>
      ${this.isOn?h`<label>
            Time for each choice
            <select @change=${i}>
              ${Ut.map(s=>h`<option value=${s} ?selected=${s===this.seconds}>${s} s</option>`)}
            </select>
          </label>`:p}`}set(t){clearInterval(this.timer),this.isOn=t,this.timer=t?window.setInterval(()=>this.next(),1e3*this.seconds):0,this.host.requestUpdate()}next(){let t=document.activeElement;for(;t?.shadowRoot?.activeElement;)t=t.shadowRoot.activeElement;if(t?.matches("select"))return;let e=this.choices(),i=e.findIndex(s=>s===t);e[(i+1)%e.length]?.focus()}};var at=ve`
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
`;function lt(r,t,e){let i=URL.createObjectURL(new Blob([r],{type:"text/javascript"})),s=new Worker(i);return URL.revokeObjectURL(i),s.onmessage=n=>t(n.data),s.onerror=n=>e(n.message||"the worker has stopped"),s}var dt=512,ht=["none","rhp","oracle"],ct=15,$=class extends w{constructor(){super(...arguments);this.workerSource="";this.story=[];this.references=new Map;this.pointing={kind:"pick_up",hand:"left"};this.isBusy=!1;this.isOver=!1;this.lastTime=0;this.elapsedFrames=0;this.scanner=new I(this,()=>this.choices());this.recordedFrame=0;this.nTraceRequests=0}static{this.styles=at}connectedCallback(){super.connectedCallback(),this.tabIndex=-1}disconnectedCallback(){super.disconnectedCallback(),this.close()}updated(e){e.has("game")&&this.game&&this.open(this.game)}close(){this.simulator?.close(),this.simulator=void 0,this.scanner.stop(),this.info=this.shown=this.problem=void 0,this.story=[],this.references=new Map,this.isOver=!1,this.recordedFrame=this.nTraceRequests=0}open(e){this.close();let i=a=>this.receive(a);this.simulator=e.startSimulator?.(i)??this.startWorker(i);let{module:s,episode:n,config:o,branch:l}=e;this.post({type:"play",module:s,episode:n,config:{...o,is_live:e.isLive},branch:l})}startWorker(e){let i=lt(this.workerSource,e,s=>this.fail(s));return{post:s=>i.postMessage(s),close:()=>i.terminate()}}post(e){this.isBusy=!0,this.simulator?.post(e)}receive(e){switch(this.isBusy=!1,e.type){case"playing":this.info=e.info,this.updateComplete.then(()=>this.begin());break;case"live":this.show(e.state),ot(this.canvas,e.view);break;case"trace":this.nTraceRequests-=1,this.game?.isStudy&&!this.problem&&this.record(e.trace),this.isOver&&this.nTraceRequests===0&&this.finish(e.trace);break;case"reference":this.references=new Map(this.references).set(e.helper,e.rate),this.compareNext();break;case"over":this.isOver=!0,this.dispatchEvent(new CustomEvent("over",{detail:"ended"}));break;case"error":this.fail(e.message);break}}fail(e){this.problem??=e,this.game?.isStudy?this.dispatchEvent(new CustomEvent("over",{detail:"left"})):this.shown&&this.stop()}begin(){this.lastTime=performance.now(),this.elapsedFrames=1,requestAnimationFrame(e=>this.advance(e))}advance(e){if(!this.simulator||this.problem||this.isOver)return;let i=(this.game?.speed??1)*(this.info?.frames_per_second??0);this.elapsedFrames+=Math.min(e-this.lastTime,250)/1e3*i,this.elapsedFrames=Math.min(this.elapsedFrames,Math.max(i,1)),this.lastTime=e;let s=this.shown?.status==="waiting"&&!this.input&&!this.game?.isLive,n=Math.floor(this.elapsedFrames);if(!this.isBusy&&n>0&&(!s||this.input)){this.elapsedFrames-=n;let o=nt(this.canvas,rt.view);this.post({type:"advance",frames:n,viewPx:o,input:this.input}),this.input&&(this.recordedFrame=-ct),this.input=void 0}else s&&(this.elapsedFrames=Math.min(this.elapsedFrames,1));requestAnimationFrame(o=>this.advance(o))}show(e){let i=e.status==="waiting"&&this.shown?.status!=="waiting",s=this.shadowRoot?.activeElement?.closest(".plans")!=null,n=i?[]:(this.shown?.plans??[]).filter(l=>e.plans.includes(l)),o=e.plans.filter(l=>!n.includes(l));this.shown={...e,plans:[...n,...o]},e.events.length>0&&(this.story=[...this.story,...e.events]),e.status==="ended"?this.stop():this.game?.isStudy&&(i||e.frame-this.recordedFrame>=ct)&&(this.recordedFrame=e.frame,this.requestTrace()),this.updateComplete.then(()=>{(i||s&&!this.shadowRoot?.activeElement)&&this.focusChoices()})}focusChoices(){let e=document.activeElement;if(e!==document.body&&e!==this)return;let i=this.shadowRoot?.querySelector("section"),s=this.shadowRoot?.activeElement;if(s&&s!==i&&!s.closest(".plans"))return;let n=i?.querySelector(".plans button");n?n.focus():i?.focus({preventScroll:!0})}stop(){this.isOver||(this.isOver=!0,this.scanner.stop(),this.requestTrace())}requestTrace(){this.nTraceRequests+=1,this.post({type:"trace",isPartial:this.game?.isStudy??!1})}record(e){e&&this.dispatchEvent(new CustomEvent("recorded",{detail:e}))}finish(e){let{episode:i,isStudy:s}=this.game;if(s){let n=this.shown?.status==="ended"?"ended":"stopped";this.dispatchEvent(new CustomEvent("over",{detail:n}));return}this.dispatchEvent(new CustomEvent("finished",{detail:{trace:e,episode:i}})),this.shown?.status==="ended"&&this.compareNext()}compareNext(){let e=ht.find(i=>!this.references.has(i));e&&this.post({type:"reference",helper:e})}choose(e){let i=this.shown?.plans[e];this.shown?.status==="waiting"&&!this.isOver&&i!==void 0&&(this.input={plan:i})}act(e){this.shown?.status==="waiting"&&(this.input={action:e})}point(e){if(this.game?.config.level!=="steps")return;let i=e.currentTarget.getBoundingClientRect(),s=(d,f)=>Math.max(0,Math.min(dt-1,Math.floor(d/f*dt))),n={column:s(e.clientX-i.left,i.width),row:s(e.clientY-i.top,i.height)},{kind:o,hand:l}=this.pointing,a={pick_up:"object",put_on:"place",remove_obstacle:"obstacle"}[o];this.act({[o]:{[a]:{pixel:n},hand:l}})}press(e){let i=e.composedPath()[0];if(e.ctrlKey||e.altKey||e.metaKey||i.matches("select, input"))return;let s=this.game?.config.level==="steps",n=/^[1-9]$/.test(e.key)&&!e.repeat?Number(e.key)-1:void 0,l=s?{ArrowUp:"move_forward",ArrowLeft:"turn_left",ArrowRight:"turn_right",".":{wait:{frames:10}}}[e.key]:void 0;if(l)this.act(l);else if(!s&&n!==void 0)this.choose(n);else return;e.preventDefault()}choices(){return[...this.shadowRoot.querySelectorAll(".plans button, button.link, input.scan")]}render(){let{info:e,shown:i}=this;if(this.problem)return h`<p class="problem" role="alert">Cannot play: ${this.problem}</p>`;if(!e)return this.isOver?h``:h`<p role="status">Loading ...</p>`;let s=this.game?.config.level==="plans"?this.plans(i):this.steps(i);return h`<section aria-label="Play" tabindex="-1" @keydown=${n=>this.press(n)}>
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
          ${i?this.status(i):p}
          ${this.isOver?p:h`${s}
                <p><button type="button" class="link" @click=${()=>this.stop()}>Stop here</button></p>`}
          ${i?.status==="ended"&&!this.game?.isStudy?this.result(i):p} ${this.events()}
        </div>
      </div>
    </section>`}heading(e){let i=this.game?.config.seat===1,[s,n]=e.reach_m.map(l=>l.toFixed(2)),o=i?"The partner wants something that you do not know. Find out and help.":`Your body: ${e.person}. You want ${e.goal.join(", ")}.`;return h`<header>
      <h2>${e.task}: you are the ${i?"helper":"partner"}</h2>
      <p>${o} You reach from ${s} to ${n} m and lift ${e.strength_kg.toFixed(0)} kg.</p>
      <p class="small">${e.episode?`${e.episode}. `:""}A simulation: real people differ from these bodies and views.</p>
    </header>`}time(e){return it(e,this.info?.frames_per_second??1)}status(e){let{action:i,plan:s}=e.caption,n=e.hands.map(a=>a??"nothing"),o=e.progress?`, ${st(...e.progress,this.info?.unit??"")}`:"",l=e.is_refused?"Your last choice was no longer possible. Choose again.":"";return h`<p class="time">
        ${this.time(e.frame)} of ${this.time(e.horizon)}${o}
      </p>
      <p>Left hand: ${n[0]}; right hand: ${n[1]}</p>
      <p role="status">You: ${i}${s?` (${s})`:""}${e.failure?`; failed: ${e.failure}`:""}</p>
      <p role="status">${this.isOver?"The game has ended.":l}</p>`}plans(e){return h`<h3>What next?</h3>
      <ol class="plans">
        ${tt(e?.plans??[],i=>i,(i,s)=>h`<li><button type="button" @click=${()=>this.choose(s)}>${i}</button></li>`)}
      </ol>
      ${e?.status==="running"?h`<p>Doing it ...</p>`:p}
      ${this.game?.isStudy?p:this.scanner.controls("Offer one plan after the other, for a single switch")}`}steps(e){let i=(o,l)=>h`<button type="button" @click=${()=>this.act(l)}>${o}</button>`,s=o=>{let[l,a]=o.target.value.split(" ");this.pointing={kind:l,hand:a}},n=[["pick_up left","picks up with the left hand"],["pick_up right","picks up with the right hand"],["put_on left","puts what the left hand holds there"],["put_on right","puts what the right hand holds there"],["remove_obstacle left","removes an obstacle"]];return h`<div class="controls" role="group" aria-label="Actions">
        ${i("Turn left (left arrow)","turn_left")} ${i("Walk (up arrow)","move_forward")}
        ${i("Turn right (right arrow)","turn_right")} ${i("Put into the container","put_in")}
        ${i("Wait (.)",{wait:{frames:10}})}
      </div>
      <label>
        A click on the picture
        <select @change=${s}>
          ${n.map(([o,l])=>h`<option value=${o}>${l}</option>`)}
        </select>
      </label>
      ${e?.status==="running"?h`<p>Acting ...</p>`:p}`}result(e){let[i,s]=e.progress??[0,0],n=s>0?i/s:0,o=a=>a===void 0?"...":`${(100*a).toFixed(0)} %`,l=this.game?.config.seat===1?"your help":"you as the partner";return h`<h3>Result</h3>
      <table>
        <caption>Delivered part of the goal, same episode and seed</caption>
        <tr><th scope="row">${l}</th><td class="number">${o(n)}</td></tr>
        ${ht.map(a=>h`<tr>
            <th scope="row">simulated partner, ${a==="none"?"no helper":`helper ${a}`}</th>
            <td class="number">${o(this.references.get(a))}</td>
          </tr>`)}
      </table>`}events(){return h`<div class="story">
      <h3>Events</h3>
      <ol reversed>
        ${[...this.story].reverse().map(e=>h`<li><span class="time">${this.time(e.frame)}</span> ${e.text}</li>`)}
      </ol>
    </div>`}};u([A({attribute:!1})],$.prototype,"game",2),u([A({attribute:!1})],$.prototype,"workerSource",2),u([v()],$.prototype,"info",2),u([v()],$.prototype,"shown",2),u([v()],$.prototype,"story",2),u([v()],$.prototype,"problem",2),u([v()],$.prototype,"references",2),u([v()],$.prototype,"pointing",2),u([U("canvas")],$.prototype,"canvas",2),u([v()],$.prototype,"isOver",2);customElements.define("chaic-play",$);function pt(r,t){let e=r.slots[t-1]??[],i=[{kind:"instructions"}],s=o=>r.conditions[o]?.seat==="helper"?"partner":"helper";e.forEach((o,l)=>{i.push({kind:"trial",number:l,trial:o});let[a,d]=o,f=e[l+1]?.[0]!==a;if(!(a===0||!f))for(let c of r.after_condition)i.push({kind:"form",position:a,name:c,other:s(d)})});let n=e.at(-1)?.[1]??0;for(let o of r.at_end)i.push({kind:"form",position:0,name:o,other:s(n)});return[...i,{kind:"debrief"}]}function Nt(r,t){return t.some(e=>{switch(r.kind){case"instructions":return e.type==="instructed";case"trial":return e.type==="trial_end"&&e.trial===r.number;case"form":return e.type==="answers"&&e.position===r.position&&e.form===r.name;case"debrief":return!1}})}function ut(r,t){let e=r.findIndex(i=>!Nt(i,t));return e<0?r.length-1:e}function he(r){let t=r.filter(i=>i.type==="trial").at(-1);return t&&!r.some(i=>i.type==="trial_end"&&i.trial===t.trial)?t.trial:void 0}var It=7,O=class extends w{constructor(){super(...arguments);this.other="helper";this.ratings={};this.isWarned=!1}createRenderRoot(){return this}missing(){return(this.form?.items??[]).filter(e=>this.ratings[e.id]===void 0)}nextInputs(){let[e]=this.missing();return e?[...this.querySelectorAll(`fieldset[data-item="${e.id}"] input`)]:[...this.querySelectorAll("button")]}submit(e){e.preventDefault();let i=this.missing();if(i.length>0&&!this.isWarned){this.isWarned=!0,this.querySelector(`fieldset[data-item="${i[0].id}"] input`)?.focus();return}let s=this.form.items.map(n=>[n.id,this.ratings[n.id]??null]);this.dispatchEvent(new CustomEvent("answered",{detail:Object.fromEntries(s)}))}render(){let{form:e}=this;if(!e)return h``;let i=this.missing().length,s=n=>n.replaceAll("{other}",this.other);return h`<form class="questions" @submit=${n=>this.submit(n)}>
      <p>${s(e.instruction)}</p>
      ${e.items.map(n=>this.item(e,n,s(n.text)))}
      ${this.isWarned&&i>0?h`<p role="alert">${i===1?"One question has":`${i} questions have`} no answer. You may leave them out: select Continue again.</p>`:p}
      <p><button>Continue</button></p>
    </form>`}item(e,i,s){let n=Math.floor((e.last-e.first)/e.step)+1,o=Array.from({length:n},(d,f)=>e.first+f*e.step),l=d=>{this.ratings={...this.ratings,[i.id]:d}},a=d=>d===e.first?`${d}, ${i.low}`:d===e.last?`${d}, ${i.high}`:String(d);return h`<fieldset data-item=${i.id}>
      <legend>${s}</legend>
      <p class="small" aria-hidden="true">${e.first}: ${i.low}, ${e.last}: ${i.high}</p>
      <div class="ratings" style="--n: ${n}; --narrow: ${Math.min(n,It)}">
        ${o.map(d=>h`<label class="rating">
            <input
              type="radio"
              name=${i.id}
              value=${d}
              aria-label=${a(d)}
              .checked=${this.ratings[i.id]===d}
              @change=${()=>l(d)}
            /><span aria-hidden="true">${d}</span>
          </label>`)}
      </div>
    </fieldset>`}};u([A({attribute:!1})],O.prototype,"form",2),u([A()],O.prototype,"other",2),u([v()],O.prototype,"ratings",2),u([v()],O.prototype,"isWarned",2);customElements.define("chaic-form",O);var K="records",G="identity";function ce(r){return new Promise((t,e)=>{r.onsuccess=()=>t(r.result),r.onerror=()=>e(r.error)})}function Te(r){let t=r instanceof Error?`${r.name}: ${r.message}`:"no reason given";return new Error(`this browser does not store your data (${t}). Use a window that is not private, let this page store data, or free space on the disk. Then load this page again`)}var Bt=3e3;function mt(r){return navigator.locks?new Promise(t=>{let e=()=>(t(!0),new Promise(()=>{}));navigator.locks.request(r,{signal:AbortSignal.timeout(Bt)},e).catch(()=>t(!1))}):Promise.resolve(!0)}var J=class r{constructor(t,e,i){this.name=t;this.database=e;this.records=i;this.isClosed=!1;this.nStored=i.length,e.onversionchange=()=>{e.close(),this.isClosed=!0,this.failure=new Error("its data were deleted in another tab. Load this page again")}}static async open(t,e){let i=!1;try{let s=indexedDB.open(t,1);s.onupgradeneeded=()=>{e?(s.result.createObjectStore(K,{autoIncrement:!0}),s.result.createObjectStore(G)):(i=!0,s.transaction.abort())};let n=await ce(s),o=await ce(n.transaction(K).objectStore(K).getAll());return new r(t,n,o)}catch(s){if(i)return;throw Te(s)}}async append(t){if(this.failure)throw this.failure;this.records.push(t);try{await this.change(K,e=>e.add(t))}catch(e){throw this.records.splice(this.records.indexOf(t),1),this.failure??=e instanceof Error?e:Te(e),e}this.nStored+=1}async readIdentity(){return this.isClosed||!this.database.objectStoreNames.contains(G)?void 0:await ce(this.database.transaction(G).objectStore(G).get(1))}setIdentity(t){return this.change(G,e=>e.put(t,1))}async clear(){this.records.length=0,this.nStored=0,await this.change(K,t=>t.clear())}change(t,e){return new Promise((i,s)=>{let n=this.database.transaction(t,"readwrite",{durability:"strict"});n.oncomplete=()=>i(),n.onabort=()=>s(Te(n.error)),e(n.objectStore(t))})}async delete(t){this.database.close();let e=indexedDB.deleteDatabase(this.name);e.onblocked=t,await ce(e),this.records.length=0}toText(){return this.records.map(t=>JSON.stringify(t)+`
`).join("")}};var jt=[1e3,3e4],qt=2e5,Ft=2e4,Wt=32;function ft(){let r=crypto.getRandomValues(new Uint8Array(Wt));return Array.from(r,t=>t.toString(16).padStart(2,"0")).join("")}var Yt=({status:r})=>r===0||r===408||r===429||r>=500;function zt(r){let[t,e]=jt;return new Promise(i=>{let s=()=>{clearTimeout(n),removeEventListener("online",s),i()},n=setTimeout(s,Math.min(t*2**r,e));addEventListener("online",s)})}var B=class{constructor(t){this.identity=t;this.aborted=new AbortController}abort(){this.aborted.abort()}async enter(){let{status:t,start:e,stored:i,error:s}=await this.repeated("PUT","");if(t===0)return"aborted";if(e&&i!==void 0)return{start:e,stored:i};if(t===410)return"full";if(t===401)return"taken";throw new Error(s??`the server answers ${t}`)}async delete(){let{status:t,error:e}=await this.repeated("DELETE","");if(t!==200&&t!==404)throw new Error(e??`the server answers ${t}`)}async data(){let{bytes:t,error:e}=await this.request("GET","/data");if(e!==void 0)throw new Error(e);return t}async repeated(t,e,i,s){for(let n=0;;n++){let o=await this.request(t,e,i);if(this.aborted.signal.aborted||!Yt(o))return o;s?.(),await zt(n)}}async request(t,e,i){let{code:s,token:n}=this.identity;try{let o=await fetch(`participants/${s}${e}`,{method:t,body:i,headers:{Authorization:`Bearer ${n}`},cache:"no-store",keepalive:(i?.length??0)<Ft,signal:AbortSignal.any([this.aborted.signal,AbortSignal.timeout(3e4)])});return o.headers.get("Content-Type")==="application/octet-stream"?{status:o.status,bytes:new Uint8Array(await o.arrayBuffer())}:{...await o.json(),status:o.status}}catch{return{status:0}}}},pe=class{constructor(t,e,i,s,n){this.participant=t;this.log=e;this.stored=i;this.isServerWriting=s;this.onChange=n;this.state="sending";this.problem="";this.isRunning=!1;this.waiters=[]}stop(){this.participant.abort()}async send(){if(!(this.isRunning||this.state==="refused")){for(this.isRunning=!0;this.stored===void 0||this.stored<this.log.nStored;){let t=this.stored;this.state==="saved"&&this.set("sending");let e=t===void 0?await this.participant.repeated("GET","",void 0,()=>this.set("waiting")):await this.participant.repeated("PUT",`/records/${t}`,this.batch(t),()=>this.set("waiting"));if(e.status===0)return;let i=this.log.records.length+(this.isServerWriting?1:0);if(e.stored===void 0||e.stored>i){this.problem=e.error??"the server has more data than this browser",this.set("refused");return}this.stored=e.stored}this.isRunning=!1,this.set("saved");for(let t of this.waiters.splice(0))t()}}async sent(){let t=new Promise(e=>this.waiters.push(e));await this.send(),await t}set(t){t!==this.state&&(this.state=t,this.onChange())}batch(t){let e="";for(let i of this.log.records.slice(t,this.log.nStored)){let s=JSON.stringify(i)+`
`;if(e!==""&&e.length+s.length>qt)break;e+=s}return e}};async function Vt(r){let t=await createImageBitmap(new Blob([r],{type:"image/png"})),{width:e,height:i}=t,s=new OffscreenCanvas(e,i).getContext("2d");s.drawImage(t,0,0),t.close();let n=s.getImageData(0,0,e,i).data;return{width:e,height:i,rgba:n}}var ue=class{constructor(t,e,i,s){this.participant=t;this.trial=e;this.receive=i;this.onConnection=s;this.next=0;this.last=Promise.resolve();this.isClosed=!1;this.lastTime=0}post(t){this.last=this.last.then(()=>this.answer(t)).catch(e=>this.send({type:"error",message:String(e)}))}close(){this.isClosed=!0}send(t){this.isClosed||this.receive(t)}async request(t,e){let i=!1,s=o=>{o!==i&&this.onConnection(i=o)},n=await this.participant.repeated("PUT",`/trials/${this.trial}${t}`,e,()=>s(!0));return s(!1),n}async answer(t){this.isClosed||(t.type==="play"?await this.open():t.type==="trace"?this.send({type:"trace",trace:""}):t.type==="advance"&&await this.advance(t))}async open(){let t=await this.request("");if(!t.info)return this.refused(t);this.next=t.next??0,this.send({type:"playing",info:t.info})}refused({status:t,error:e}){t!==0&&(t===410?this.send({type:"over"}):this.send({type:"error",message:e??`the server answers ${t}`}))}async advance(t){let e=this.lastTime+70-performance.now();e>0&&await new Promise(d=>setTimeout(d,e)),this.lastTime=performance.now();let{frames:i,viewPx:s,input:n}=t,o=await this.request(`/turns/${this.next}`,JSON.stringify({frames:i,view_px:s,input:n}));if(o.status===409){let d=await this.request("");if(!d.info)return this.refused(d);this.next=d.next??0,o=await this.request(`/turns/${this.next}`,JSON.stringify({frames:0,view_px:s}))}if(!o.bytes)return this.refused(o);this.next+=1;let l=o.bytes.indexOf(10),a=JSON.parse(new TextDecoder().decode(o.bytes.subarray(0,l)));this.send({type:"live",state:a,view:await Vt(o.bytes.slice(l+1))})}};function gt(r){let[t=""]=r,e=/^(#{1,2}) (.*)$/.exec(t);if(e){let i=r.length>1?gt(r.slice(1)):h``;return e[1]==="#"?h`<h2>${e[2]}</h2>${i}`:h`<h3>${e[2]}</h3>${i}`}return r.every(i=>i.startsWith("- "))?h`<ul>${r.map(i=>h`<li>${i.slice(2)}</li>`)}</ul>`:h`<p>${r.join(" ")}</p>`}function me(r){return r.split(/\r?\n[ \t]*\r?\n/).map(e=>e.split(/\r?\n/).map(i=>i.trim())).map(e=>e.filter(i=>i!=="")).filter(e=>e.length>0).map(gt)}var vt="ABCDEFGHJKLMNPQRSTUVWXYZ23456789",Kt=10,Gt=6e4;function yt(){let r=crypto.getRandomValues(new Uint8Array(Kt));return Array.from(r,t=>vt[t%vt.length]).join("")}var y=class extends w{constructor(){super(...arguments);this.isLoading=!0;this.steps=[];this.at=0;this.playing="before";this.isResumed=!1;this.hasLeft=!1;this.isChanging=!1;this.isConnectionLost=!1;this.isDeletionBlocked=!1;this.hasDownloadFailed=!1;this.scanner=new I(this,()=>this.choices())}createRenderRoot(){return this}connectedCallback(){super.connectedCallback(),addEventListener("hashchange",()=>location.reload()),addEventListener("unhandledrejection",e=>this.fail(e.reason)),this.load().catch(e=>this.fail(e))}fail(e){this.problem=e instanceof Error?e.message:String(e)}async load(){let e=await Ae(document.getElementById("chaic-study")),i=JSON.parse(new TextDecoder().decode(e));if(this.content=i,!i.server&&!this.takeSlot(Number(/^#(\d{1,5})$/.exec(location.hash)?.[1]))){this.isLoading=!1;return}if(!await mt(this.logName())){this.problem="it is open in another tab. Go on there, or close that tab and load this page again.";return}let s=await J.open(this.logName(),!1),n=await s?.readIdentity();s&&n?await this.resumeWithServer(s,n):s?.records.length&&await this.resume(s),this.isLoading=!1}takeSlot(e){return this.content?.slots[e-1]?(this.slotNumber=e,this.steps=pt(this.content,e),!0):!1}logName(){let{digest:e,server:i}=this.content;return`chaic-study-${e}-${i?"server":this.slotNumber}`}async resumeWithServer(e,i){let[s]=e.records;i.isLeaving?(this.hasLeft=!0,this.waits="deletion",this.deleteEverywhere(e,i).then(()=>this.waits=void 0)):s?.type!=="start"?this.enter(e,i):(this.takeSlot(s.slot),this.startUpload(e,new B(i),void 0),await this.resume(e))}startUpload(e,i,s){let n=()=>{this.upload?.state==="refused"&&this.fail(`${this.upload.problem}. Your data are kept in this browser.`),this.requestUpdate()};this.participant=i,this.upload=new pe(i,e,s,this.isSimulatedByServer(),n),this.upload.send()}isSimulatedByServer(){return this.content?.play.simulator==="server"}async store(e){await this.log?.append(e),this.upload?.send()}async resume(e){this.log=e,this.isResumed=!0;let i=he(e.records);i!==void 0&&!this.isSimulatedByServer()&&await this.store({type:"trial_end",trial:i,outcome:"left"}),this.at=ut(this.steps,e.records),await this.completeAtEnd()}async once(e){if(!this.isChanging){this.isChanging=!0;try{await e()}finally{this.isChanging=!1}}}async agree(){let{format:e,version:i,chaic:s,digest:n,server:o}=this.content,l=await J.open(this.logName(),!0);if(!l)return;if(this.problem=void 0,this.hasLeft){await this.deleteLog(l);return}if(o){await this.enter(l);return}let a={format:e,version:i,chaic:s,study:n,code:yt(),slot:this.slotNumber};await l.append({type:"start",...a}),this.log=l,this.focusHeading()}async enter(e,i){let s=i??{code:yt(),token:ft(),isLeaving:!1};i||await e.setIdentity(s);let n=new B(s);this.entering={log:e,participant:n},this.waits="entry";let o=await n.enter();if(!(o==="aborted"||this.hasLeft)){if(o==="taken")await this.enter(e);else if(o==="full")this.entering=void 0,await this.deleteLog(e),this.waits="full",this.focusHeading();else if(o.start.type==="start"&&this.takeSlot(o.start.slot)){if(await e.append(o.start),this.hasLeft)return;this.entering=void 0,this.waits=void 0,this.log=e,this.startUpload(e,n,o.stored),this.focusHeading()}}}async advance(e){e&&await this.store(e),this.at+=1,this.playing="before",this.game=void 0,this.isResumed=!1,await this.completeAtEnd(),this.focusHeading()}async completeAtEnd(){let e=this.steps[this.at]?.kind==="debrief",i=this.log?.records.some(s=>s.type==="complete");e&&!i&&await this.store({type:"complete"})}async leave(){this.dialog?.close(),this.playing="before",this.game=void 0;let{entering:e,upload:i}=this,s=this.log??e?.log;this.log=void 0,this.entering=void 0,this.hasLeft=!0,this.waits="deletion",e?.participant.abort(),i?.stop();let n=await s?.readIdentity();this.focusHeading(),s&&n?await this.deleteEverywhere(s,n):s&&await this.deleteLog(s),this.waits=void 0}async deleteLog(e){await e.delete(()=>this.isDeletionBlocked=!0),this.isDeletionBlocked=!1}async deleteEverywhere(e,i){await e.setIdentity({...i,isLeaving:!0}),await e.clear(),await new B(i).delete(),await this.deleteLog(e)}async removeCopy(){let{log:e}=this;this.upload?.stop(),e&&await this.deleteLog(e),this.log=void 0,this.waits="removed",this.focusHeading()}focusHeading(){this.updateComplete.then(()=>{this.querySelector("h1")?.focus(),scrollTo(0,0)})}code(){let[e]=this.log?.records??[];return e?.type==="start"?e.code:""}async startTrial(e){let{content:i,log:s}=this;if(!i||!s)return;let n=this.isSimulatedByServer();n||(this.module??=await Qe());let[,o,l,a]=e.trial,{seat:d,input:f}=i.conditions[o];he(s.records)===e.number||await this.store({type:"trial",trial:e.number}),this.game={module:this.module??new ArrayBuffer(0),episode:new TextEncoder().encode(i.episodes[l??-1]??""),config:{seed:i.seed,seat:d==="partner"?0:1,level:f,helper:a??"none"},isLive:i.play.world==="goes_on",speed:i.play.speed,isStudy:!0,startSimulator:n?g=>this.startSimulator(e.number,g):void 0},this.playing="running",this.updateComplete.then(()=>this.player?.focus({preventScroll:!0}))}startSimulator(e,i){let s=l=>{this.isConnectionLost=l},n=new ue(this.participant,e,i,s),o=this.upload.sent();return{post:l=>{o.then(()=>n.post(l))},close:()=>n.close()}}endTrial(e,i){this.endedTrial!==e&&(this.endedTrial=e,this.store({type:"trial_end",trial:e,outcome:i}).then(()=>{this.playing="over",this.updateComplete.then(()=>this.querySelector("#continue")?.focus())}))}async download(){let e=this.isSimulatedByServer()?await this.participant?.data().catch(()=>{}):this.log?.toText();if(this.hasDownloadFailed=e===void 0,e===void 0)return;let i=document.createElement("a");i.href=URL.createObjectURL(new Blob([e],{type:"application/jsonl"})),i.download=`${this.code()}.jsonl`,i.click(),setTimeout(()=>URL.revokeObjectURL(i.href),Gt)}choices(){let e=(o,l)=>[...o.querySelectorAll(l)].filter(a=>a.checkVisibility());if(this.dialog?.open)return e(this.dialog,"button");let i=e(this,"#leave");if(this.form)return[...this.form.nextInputs(),...i];let s=this.playing==="running"?this.player?.shadowRoot:void 0;return[...s?e(s,".plans button, .controls button, button.link"):[],...e(this,".step > p > button"),...i]}press(e){let i=e.target;e.key!=="Enter"||!i.matches("input[type=radio], input[type=checkbox]")||(e.preventDefault(),i.click())}render(){let e=this.log?`Part ${this.at+1} of ${this.steps.length}`:"";return h`<div class="study" @keydown=${i=>this.press(i)}>
      ${this.bar()}
      <section class="step">
        ${this.problem?h`<p class="problem" role="alert">The study cannot go on: ${this.problem}</p>`:p}
        <p class="small" role="status">${e}</p>
        <p class="small" role="status">${this.delay()}</p>
        ${this.current()}
      </section>
      ${this.question()}
    </div>`}delay(){if(this.isDeletionBlocked)return"This study is open in another tab, so the data in this browser are not deleted yet. Close that tab.";let e=this.playing==="running"&&this.isSimulatedByServer();return this.hasLeft||!(this.upload?.state==="waiting"||e&&this.isConnectionLost)?"":e?"There is no connection to the server. The episode goes on when it is back.":"There is no connection to the server. Go on: your data are kept in this browser and sent later."}bar(){let e=this.hasLeft||this.waits==="removed";return h`<div class="bar" role="group" aria-label="Study">
      ${this.scanner.controls("One switch: offers one choice after the other")}
      <button type="button" id="leave" ?disabled=${e} @click=${()=>this.dialog?.showModal()}>
        Stop and delete
      </button>
    </div>`}question(){return h`<dialog aria-labelledby="leave-title">
      <h2 id="leave-title">Stop and delete?</h2>
      <p>The study ends, and all your data ${this.places()} are deleted.</p>
      <p>
        <button type="button" @click=${()=>{this.leave()}}>Delete and stop</button>
        <button type="button" @click=${()=>this.dialog?.close()}>Go on with the study</button>
      </p>
    </dialog>`}places(){return this.content?.server?"in this browser and on the server":"in this browser"}current(){let{content:e}=this;if(!e||this.isLoading)return this.problem?h``:h`<p role="status">Loading ...</p>`;if(this.hasLeft)return h`${this.heading("You have stopped")}
        <p role="status">${this.deletion(e)}</p>`;switch(this.waits){case"entry":return h`${this.heading(e.title)}
          <p role="status">The page asks the server for a place until it answers ...</p>`;case"full":return h`${this.heading("All places are taken")}
          <p>Thank you. Nothing is stored. You may close this page.</p>`;case"removed":return h`${this.heading("The end")}
          <p>The copy in this browser is removed. The next participant can load this page again.</p>`}if(this.slotNumber===void 0&&!e.server)return this.slotQuestion(e);if(!this.log)return this.consent(e);let i=this.steps[this.at];switch(i.kind){case"instructions":return this.instructions(e);case"trial":return this.trial(i);case"form":return this.questions(e,i);case"debrief":return this.debrief(e)}}deletion({server:e}){return this.waits!=="deletion"?`All your data ${this.places()} are deleted. You may close this page.`:!e||this.isDeletionBlocked?"Your data are being deleted. Keep this page open.":"The server has not confirmed the deletion yet. Keep this page open, or open it again later."}heading(e){return h`<h1 tabindex="-1">${e}</h1>`}slotQuestion({title:e,slots:i}){let s=n=>{n.preventDefault();let o=new FormData(n.target).get("slot");location.hash=`#${Number(o)}`};return h`${this.heading(e)}
      <form @submit=${s}>
        <label>
          Your participant number, 1 to ${i.length}
          <input type="number" name="slot" min="1" max=${i.length} required />
        </label>
        <button>Continue</button>
      </form>`}consent({title:e,consent:i}){return h`${this.heading(e)} ${me(i)}
      <p class="small">Nothing is stored before you agree.</p>
      <p>
        <button type="button" @click=${()=>{this.once(()=>this.agree())}}>I agree and take part</button>
        <button type="button" @click=${()=>{this.leave()}}>I do not take part</button>
      </p>`}instructions({instructions:e}){return h`${this.heading("Instructions")} ${me(e)}
      <p>Your code is <b class="code">${this.code()}</b>. Keep it: with it, the researchers can delete your data later.</p>
      <p><button type="button" @click=${()=>{this.once(()=>this.advance({type:"instructed"}))}}>Continue</button></p>`}trial(e){let i=this.steps.filter(d=>d.kind==="trial"),s=e.trial[0]===0,n=he(this.log?.records??[])===e.number,o=this.isSimulatedByServer()?"":"An episode that was interrupted is not repeated.",l=n?"The episode goes on where you were.":o,a=`Episode ${e.number+1} of ${i.length}${s?", practice":""}`;return this.playing==="before"?h`${this.heading(a)}
        ${this.isResumed?h`<p>The study goes on here. ${l}</p>`:p}
        <p>${s?"This episode is for practice.":"This episode counts."}</p>
        <p>
          <button type="button" @click=${()=>{this.once(()=>this.startTrial(e))}}>
            ${n?"Go on with the episode":"Start the episode"}
          </button>
        </p>`:h`${this.heading(a)}
      <chaic-play
        .workerSource=${this.isSimulatedByServer()?"":Ze()}
        .game=${this.game}
        @recorded=${d=>{this.store({type:"trace",trial:e.number,text:d.detail})}}
        @over=${d=>this.endTrial(e.number,d.detail)}
      ></chaic-play>
      ${this.playing==="over"?h`<p>The episode is over. <button type="button" id="continue" @click=${()=>{this.once(()=>this.advance())}}>Continue</button></p>`:p}`}questions(e,i){let s=e.forms[i.name],n=o=>{let{position:l,name:a}=i;this.once(()=>this.advance({type:"answers",position:l,form:a,ratings:o.detail}))};return h`${this.heading(s.title)}
      ${Xe(`${i.position} ${i.name}`,h`<chaic-form .form=${s} .other=${i.other} @answered=${n}></chaic-form>`)}`}debrief(e){return h`${this.heading("The end")} ${me(e.debrief)}
      <p>Completion code: <b class="code">${e.completion_code}</b></p>
      <p>Your code: <b class="code">${this.code()}</b>. With it, the researchers can delete your data.</p>
      <p>
        <button type="button" @click=${()=>{this.download()}}>Download your data</button>
      </p>
      <p role="status">${this.hasDownloadFailed?"The server does not send the file now. Try again later.":""}</p>
      <p class="small">The file has your answers and your decisions. It has no name, no address and no times of day.
        "Stop and delete" removes ${e.server?"all your data, also on the server":"the copy in this browser"}.</p>
      ${this.upload?this.uploaded(this.upload):p}`}uploaded({state:e}){return e!=="saved"?h`<p role="status">The server does not have all your data yet. Keep this page open, or open it again
        later.
        ${this.isSimulatedByServer()?p:"If that does not help, download your data and send them to the researchers."}</p>`:h`<p role="status">The server has all your data. You may close this page.</p>
      <p><button type="button" @click=${()=>{this.removeCopy()}}>Remove the copy in this browser</button></p>`}};u([v()],y.prototype,"content",2),u([v()],y.prototype,"isLoading",2),u([v()],y.prototype,"slotNumber",2),u([v()],y.prototype,"log",2),u([v()],y.prototype,"steps",2),u([v()],y.prototype,"at",2),u([v()],y.prototype,"playing",2),u([v()],y.prototype,"isResumed",2),u([v()],y.prototype,"hasLeft",2),u([v()],y.prototype,"problem",2),u([v()],y.prototype,"waits",2),u([U("dialog")],y.prototype,"dialog",2),u([U("chaic-play")],y.prototype,"player",2),u([U("chaic-form")],y.prototype,"form",2),u([v()],y.prototype,"isConnectionLost",2),u([v()],y.prototype,"isDeletionBlocked",2),u([v()],y.prototype,"hasDownloadFailed",2);customElements.define("chaic-study",y);})();
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
