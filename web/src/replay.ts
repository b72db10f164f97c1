// Element <chaic-replay>: one replay with views, map, timeline and list of events.

import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from "lit";
import { property, query, queryAll, state } from "lit/decorators.js";
import { PlaybackClock } from "./clock.js";
import { controls } from "./controls.js";
import { clock, delivered, lastBefore } from "./frames.js";
import { badge } from "./badge.js";
import { language } from "./language.js";
import { MapLayers } from "./layers.js";
import type { AgentInfo, Belief, FrameState, ReplayInfo, Wanted } from "./messages.js";
import { drawnSize, MAX_PX, paint, paintMap } from "./pictures.js";
import { ReplayPlayer, type DrawnFrame, type Source } from "./player.js";
import { styles } from "./styles.js";
import { timeline } from "./timeline.js";
import { WidthObserver } from "./width.js";

/** Largest number of hypotheses of a belief that are listed. */
const MAX_BARS = 5;

/** Replay of a trace. Set `source` and `workerSource`. */
export class ChaicReplay extends LitElement {
  static override styles = styles;

  /** Module, trace and episode. */
  @property({ attribute: false }) source?: Source;
  /** Program of the worker. */
  @property({ attribute: false }) workerSource = "";
  /** Frame that is shown first. */
  @property({ type: Number }) start = 0;

  @state() private info?: ReplayInfo;
  @state() private shown?: FrameState;
  @state() private problem?: string;

  @queryAll("canvas.view") private viewCanvases!: NodeListOf<HTMLCanvasElement>;
  @query("canvas.map") private mapCanvas?: HTMLCanvasElement;
  @query("select.successor") private successor?: HTMLSelectElement;
  @query("canvas.layers") private layerCanvas?: HTMLCanvasElement;

  private readonly layers = new MapLayers(this, () => this.chooseLayers());
  private isRerunning = false;
  private player?: ReplayPlayer;
  private readonly playback = new PlaybackClock(
    this,
    (frame) => this.moved(frame),
    () => this.player?.isDrawing ?? true,
  );

  constructor() {
    super();
    new WidthObserver(this, () => this.player?.seek(this.frame));
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.player?.close();
    this.player = undefined;
  }

  override updated(changed: PropertyValues<this>): void {
    if (changed.has("source") && this.source) this.open(this.source);
  }

  /** Shows a frame and stops. If the replay is not verified yet, it is the first frame shown. */
  seek(frame: number): void {
    if (!this.info?.is_complete) this.start = frame;
    this.playback.seek(frame);
  }

  /** Shown frame. */
  get frame(): number {
    return this.playback.frame;
  }

  private open(source: Source): void {
    this.player?.close();
    this.info = this.shown = this.problem = undefined;
    this.isRerunning = false;
    this.layers.reset();
    this.playback.reset();
    const informed = (info: ReplayInfo): void => {
      this.info = info;
      // The size of the pictures is known after the layout.
      if (!info.is_complete) {
        void this.updateComplete.then(() => this.player?.seek(0));
        return;
      }
      this.problem = info.problem ?? undefined;
      const events = info.timeline.story.map((line) => line.frame);
      this.playback.reset({ last: info.last_frame, perSecond: info.frames_per_second, events });
      void this.updateComplete.then(() => {
        this.seek(this.start);
        this.chooseLayers();
      });
    };
    const failed = (message: string): void => {
      this.problem = message;
    };
    const drawn = (frame: DrawnFrame): void => this.draw(frame);
    const wanted = (): Wanted => ({
      agents: viewers(this.info).map((agent) => agent.id),
      viewPx: drawnSize(this.viewCanvases[0], MAX_PX.view),
      mapPx: drawnSize(this.mapCanvas, MAX_PX.map),
      memories: this.layers.memories,
      withLimits: this.layers.withLimits,
    });
    this.player = new ReplayPlayer(this.workerSource, source, wanted, informed, drawn, failed);
  }

  private moved(frame: number): void {
    this.player?.seek(frame);
    this.dispatchEvent(new CustomEvent("moved", { detail: frame }));
  }

  private draw({ state: shown, views, map, layers }: DrawnFrame): void {
    this.shown = shown;
    views.forEach((picture, k) => paint(this.viewCanvases[k], picture));
    if (!map || !this.info) return;
    paintMap(this.mapCanvas, map);
    this.layers.draw(this.layerCanvas, map, this.info.map_height, layers);
  }

  /** Draws other layers; memories need the agents to run again. */
  private chooseLayers(): void {
    const { player, layers } = this;
    player?.seek(this.frame);
    if (!player || this.isRerunning || layers.memories.length === 0) return;
    this.isRerunning = true;
    player.rerun((state) => {
      if (layers.advanced(state, this.frame)) player.seek(this.frame);
    });
  }

  override render(): TemplateResult {
    const { info } = this;
    const progress = this.problem ? nothing : html`<p role="status">Verifying ...</p>`;
    if (!info) {
      return html`<p role="status">${this.problem ? `Cannot show this replay: ${this.problem}` : "Replaying ..."}</p>`;
    }
    return html`<section aria-label="Replay" @keydown=${(event: KeyboardEvent) => this.playback.press(event)}>
      ${this.heading(info)} ${this.pictures(info)}
      ${info.is_complete ? this.details(info) : progress}
    </section>`;
  }

  /** Controls, timeline and lists, which need the whole replay. */
  private details(info: ReplayInfo): TemplateResult {
    return html`${controls(this.playback, info.last_frame, info.frames_per_second, this.status(info))}
      ${this.layers.choice(info)} ${this.layers.words(info)}
      ${timeline(info, this.frame, (frame) => this.seek(frame))} ${legend()} ${this.seats(info)}
      <div class="columns">${this.story(info)} ${this.belief(this.shown?.belief)}</div>
      ${language(this.source?.language ?? [], info, this.frame, (frame) => this.seek(frame))}`;
  }

  private heading(info: ReplayInfo): TemplateResult {
    const partner = info.agents[0];
    const done = info.timeline.deliveries.at(-1)?.done ?? 0;
    const helper = info.helper === "none" ? "Nobody helps" : `The helper ${info.helper} helps`;
    return html`<header>
      <h2>${info.task}: the partner (${partner?.person ?? ""}) wants ${info.goal.join(", ")}</h2>
      <p>
        ${helper}${info.is_complete ? `; ${delivered(done, info.total, info.unit)}` : ""}. ${limits(info)} ${branch(info)}
        ${info.is_complete ? badge(info) : nothing}
      </p>
      ${this.problem
        ? html`<p class="problem" role="alert">
            ${this.problem === info.problem
              ? `Shown up to frame ${info.last_frame} of ${info.length}`
              : "Cannot show other frames"}:
            ${this.problem}
          </p>`
        : nothing}
      <p class="small">${info.episode}, helper ${info.helper}, seed ${info.seed}, chaic ${info.chaic}</p>
    </header>`;
  }

  private pictures(info: ReplayInfo): TemplateResult {
    const detected = (id: number): FrameState["detected"][number] => this.shown?.detected[id] ?? [];
    const caption = (id: number): TemplateResult | typeof nothing => {
      const found = this.shown?.captions[id];
      if (!found) return nothing;
      const seen = found.last_observed ? html`<br />Recognized: ${found.last_observed}` : nothing;
      const labels = detected(id).map((object) => object.label);
      const list = labels.length > 0 ? html`<br />Detects: ${labels.join(", ")}` : nothing;
      return html`<b>${found.agent}</b>: ${found.action}<br />Plan: ${found.plan || "none"}${seen}${list}`;
    };
    const mark = ({ label, at: [x, y] }: { label: string; at: [number, number] }): TemplateResult =>
      html`<span
        class="detected ${x > 0.75 ? "before" : ""}"
        style="left: ${100 * x}%; top: clamp(0.5rem, ${100 * y}%, 100% - 0.5rem)"
        >${label}</span
      >`;
    return html`<div class="pictures">
      ${viewers(info).map(
        (agent) => html`<figure class="a${agent.id}">
          <div class="overlaid">
            <canvas class="view" width="384" height="384" role="img" aria-label="View of the ${agent.name}"></canvas>
            <div aria-hidden="true">${detected(agent.id).map(mark)}</div>
          </div>
          <figcaption>${caption(agent.id)}</figcaption>
        </figure>`,
      )}
      <figure>
        <div class="overlaid">
          <canvas class="map" width="480" height="480" role="img" aria-label="Map of the place with both agents"></canvas>
          <canvas class="layers" aria-hidden="true"></canvas>
        </div>
        <figcaption>Map${this.shown?.belief ? "; ring: believed position of the partner" : ""}</figcaption>
      </figure>
    </div>`;
  }

  /** Renders the controls to continue from the shown frame, as a person or with another helper. */
  private seats(info: ReplayInfo): TemplateResult | typeof nothing {
    const takeOver = (seat: number): void => {
      this.playback.seek(this.frame);
      this.dispatchEvent(new CustomEvent("take-over", { detail: { frame: this.frame, seat, seed: info.seed } }));
    };
    const goOn = (): void => {
      this.playback.seek(this.frame);
      const helper = this.successor?.value ?? "";
      this.dispatchEvent(new CustomEvent("go-on", { detail: { frame: this.frame, helper } }));
    };
    if (this.problem) return nothing;
    return html`<p class="seats">
      Take over from here as the
      ${viewers(info).map(
        ({ id, name }) => html`<button type="button" class="link" @click=${() => takeOver(id)}>${name}</button> `,
      )}
      ${info.successors.length > 0
        ? html`or let another helper go on:
            <select class="successor" aria-label="Helper that takes over">
              ${info.successors.map((name) => html`<option ?selected=${name === "oracle"}>${name}</option>`)}
            </select>
            <button type="button" ?disabled=${this.frame >= info.last_frame} @click=${goOn}>Go on and compare</button>`
        : nothing}
    </p>`;
  }

  private status(info: ReplayInfo): string {
    return delivered(this.shown?.done ?? 0, info.total, info.unit);
  }

  private story(info: ReplayInfo): TemplateResult {
    const { story } = info.timeline;
    const current = lastBefore(story, this.frame);
    return html`<div class="story">
      <h3>Events</h3>
      ${story.length === 0 ? html`<p>None.</p>` : nothing}
      <ol>
        ${story.map(
          (line, k) => html`<li>
            <button
              type="button"
              aria-current=${k === current ? "step" : "false"}
              @click=${() => this.seek(line.frame)}
            >
              <span class="time">${clock(line.frame, info.frames_per_second)}</span> ${line.text}
            </button>
          </li>`,
        )}
      </ol>
    </div>`;
  }

  private belief(belief: Belief | null | undefined): TemplateResult | typeof nothing {
    if (!belief) return nothing;
    const bars = (name: string, values: [string, number][]): TemplateResult => html`<table>
      <caption>${name}</caption>
      ${[...values]
        .sort((a, b) => b[1] - a[1])
        .slice(0, MAX_BARS)
        .map(
          ([value, perMille]) => html`<tr>
            <th scope="row">${value}</th>
            <td><meter min="0" max="1000" .value=${perMille} aria-label=${value}></meter></td>
            <td class="number">${Math.round(perMille / 10)} %</td>
          </tr>`,
        )}
    </table>`;
    return html`<div class="belief">
      <h3>What the helper believes</h3>
      ${bars("Goal", belief.goals)} ${bars("Person", belief.people)}
      ${belief.evidence?.length ? html`<p>Saw: ${belief.evidence.at(-1)}</p>` : nothing}
    </div>`;
  }
}

/** Returns the agents whose views are drawn: partner and helper. */
function viewers(info: ReplayInfo | undefined): AgentInfo[] {
  return info?.agents.filter((agent) => agent.id < 2) ?? [];
}

/** Describes the limits of the partner. */
function limits(info: ReplayInfo): string {
  const partner = info.agents[0];
  if (!partner) return "";
  const [low, high] = partner.reach_m.map((m) => m.toFixed(2));
  return `The partner reaches from ${low} to ${high} m and lifts ${partner.strength_kg.toFixed(0)} kg.`;
}

/** Describes the frame from which the replay continues another replay. */
function branch({ branch_at, frames_per_second }: ReplayInfo): string {
  return branch_at === null ? "" : `It continues another replay from ${clock(branch_at, frames_per_second)} on.`;
}

function legend(): TemplateResult {
  return html`<p class="legend">
    <span class="key walk"></span> walks <span class="key interact"></span> uses its hands
    <span class="key failed"></span> failed (×) <span class="key wait"></span> waits
    <span class="key triangle">▼</span> delivery
  </p>`;
}

customElements.define("chaic-replay", ChaicReplay);
