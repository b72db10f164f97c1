// Element <chaic-replay>: one replay with views, map, timeline and list of events.

import { html, LitElement, nothing, svg, type PropertyValues, type TemplateResult } from "lit";
import { property, query, queryAll, state } from "lit/decorators.js";
import { clock, lastBefore, nearest } from "./frames.js";
import type { Belief, FrameState, Picture, ReplayInfo } from "./messages.js";
import { ReplayPlayer, type DrawnFrame, type Sizes, type Source } from "./player.js";
import { styles } from "./styles.js";
import { timeline } from "./timeline.js";

const SPEEDS = [0.5, 1, 2, 4, 8];
/** Largest sides of views and map, pixels. Views have at most the size that helpers see. */
const MAX_PX = { view: 512, map: 720 };
/** Shapes of the buttons, in a square of 20 units. */
const ICONS = {
  previous: "M3 3h3v14H3z M17 3v14L7 10z",
  back: "M15 3v14L5 10z",
  play: "M5 3v14l12-7z",
  pause: "M4 3h4v14H4z M12 3h4v14h-4z",
  forward: "M5 3v14l10-7z",
  next: "M14 3h3v14h-3z M3 3v14l10-7z",
};
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
  @state() private frame = 0;
  @state() private isPlaying = false;
  @state() private speed = 1;
  @state() private problem?: string;

  @queryAll("canvas.view") private viewCanvases!: NodeListOf<HTMLCanvasElement>;
  @query("canvas.map") private mapCanvas?: HTMLCanvasElement;

  private player?: ReplayPlayer;
  private lastTime = 0;
  private position = 0;

  private width = 0;
  // Redraws in the new size; the height depends on the content.
  private readonly resizes = new ResizeObserver(() => {
    if (this.clientWidth === this.width) return;
    this.width = this.clientWidth;
    this.player?.seek(this.frame);
  });

  override connectedCallback(): void {
    super.connectedCallback();
    this.resizes.observe(this);
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.resizes.disconnect();
    this.isPlaying = false;
    this.player?.close();
    this.player = undefined;
  }

  override updated(changed: PropertyValues<this>): void {
    if (changed.has("source") && this.source) this.open(this.source);
  }

  /** Shows a frame and stops. */
  seek(frame: number): void {
    this.isPlaying = false;
    this.show(frame);
  }

  private open(source: Source): void {
    this.player?.close();
    this.info = this.shown = this.problem = undefined;
    this.isPlaying = false;
    const opened = (info: ReplayInfo): void => {
      this.info = info;
      this.problem = info.problem ?? undefined;
      // The size of the pictures is known after the layout.
      void this.updateComplete.then(() => this.show(this.start));
      this.dispatchEvent(new CustomEvent("opened", { detail: info }));
    };
    const failed = (message: string): void => {
      this.problem = message;
    };
    const drawn = (frame: DrawnFrame): void => this.draw(frame);
    const sizes = (): Sizes => ({
      viewPx: drawnSize(this.viewCanvases[0], MAX_PX.view),
      mapPx: drawnSize(this.mapCanvas, MAX_PX.map),
    });
    this.player = new ReplayPlayer(this.workerSource, source, sizes, opened, drawn, failed);
  }

  private show(frame: number): void {
    if (!this.info) return;
    this.frame = Math.max(0, Math.min(Math.round(frame), this.info.last_frame));
    this.position = this.frame;
    this.player?.seek(this.frame);
    this.dispatchEvent(new CustomEvent("moved", { detail: this.frame }));
  }

  private draw({ state: shown, views, map }: DrawnFrame): void {
    this.shown = shown;
    views.forEach((picture, k) => paint(this.viewCanvases[k], picture));
    paint(this.mapCanvas, map);
  }

  private toggle(): void {
    if (!this.info) return;
    if (this.frame >= this.info.last_frame) this.show(0);
    this.isPlaying = !this.isPlaying;
    this.lastTime = performance.now();
    if (this.isPlaying) requestAnimationFrame((time) => this.advance(time));
  }

  private advance(time: number): void {
    if (!this.isPlaying || !this.info) return;
    // A tab in the background gets no callbacks; the replay goes on where it was.
    const elapsed = Math.min(time - this.lastTime, 250) / 1000;
    this.lastTime = time;
    this.position += elapsed * this.speed * this.info.frames_per_second;
    const frame = Math.min(Math.floor(this.position), this.info.last_frame);
    if (frame !== this.frame && !this.player?.isDrawing) {
      this.frame = frame;
      this.player?.seek(frame);
      this.dispatchEvent(new CustomEvent("moved", { detail: frame }));
    }
    if (this.frame >= this.info.last_frame) this.isPlaying = false;
    else requestAnimationFrame((next) => this.advance(next));
  }

  private jump(direction: 1 | -1): void {
    const frames = this.info?.timeline.story.map((line) => line.frame) ?? [];
    const found = nearest(frames, this.frame, direction);
    if (found !== undefined) this.seek(found);
  }

  private press(event: KeyboardEvent): void {
    const target = event.composedPath()[0] as HTMLElement;
    if (event.ctrlKey || event.altKey || event.metaKey || target.matches("select, input")) return;
    const step = event.shiftKey ? (this.info?.frames_per_second ?? 30) : 1;
    const actions: Record<string, () => void> = {
      " ": () => this.toggle(),
      ArrowLeft: () => this.seek(this.frame - step),
      ArrowRight: () => this.seek(this.frame + step),
      "[": () => this.jump(-1),
      "]": () => this.jump(1),
      Home: () => this.seek(0),
      End: () => this.seek(this.info?.last_frame ?? 0),
    };
    const action = actions[event.key];
    // A focused button handles the space bar itself.
    if (!action || (event.key === " " && target.matches("button"))) return;
    event.preventDefault();
    action();
  }

  override render(): TemplateResult {
    const { info } = this;
    if (!info) {
      return html`<p role="status">${this.problem ? `Cannot show this replay: ${this.problem}` : "Replaying ..."}</p>`;
    }
    return html`<section aria-label="Replay" @keydown=${(event: KeyboardEvent) => this.press(event)}>
      ${this.heading(info)} ${this.pictures(info)} ${this.controls(info)}
      ${timeline(info, this.frame, (frame) => this.seek(frame))} ${legend()}
      <div class="columns">${this.story(info)} ${this.belief(this.shown?.belief)}</div>
    </section>`;
  }

  private heading(info: ReplayInfo): TemplateResult {
    const partner = info.agents[0];
    const done = info.timeline.deliveries.at(-1)?.done ?? 0;
    const helper = info.helper === "none" ? "Nobody helps" : `The helper ${info.helper} helps`;
    const verified = info.n_verified === info.n_decisions && !info.problem;
    return html`<header>
      <h2>${info.task}: the partner (${partner?.person ?? ""}) wants ${info.goal.join(", ")}</h2>
      <p>
        ${helper}; ${done} of ${info.total} delivered. ${limits(info)}
        <span class="badge ${verified ? "good" : "bad"}">
          ${verified ? "verified" : "not verified"}: ${info.n_verified} of ${info.n_decisions} decisions
        </span>
      </p>
      ${this.problem
        ? html`<p class="problem" role="alert">
            Shown up to frame ${info.last_frame} of ${info.length}: ${this.problem}
          </p>`
        : nothing}
      <p class="small">${info.episode}, helper ${info.helper}, seed ${info.seed}, chaic ${info.chaic}</p>
    </header>`;
  }

  private pictures(info: ReplayInfo): TemplateResult {
    const viewers = info.agents.filter((agent) => agent.id < 2);
    const caption = (id: number): TemplateResult | typeof nothing => {
      const found = this.shown?.captions[id];
      if (!found) return nothing;
      const seen = found.last_observed ? html`<br />Recognized: ${found.last_observed}` : nothing;
      return html`<b>${found.agent}</b>: ${found.action}<br />Plan: ${found.plan || "none"}${seen}`;
    };
    return html`<div class="pictures">
      ${viewers.map(
        (agent) => html`<figure class="a${agent.id}">
          <canvas class="view" width="384" height="384" role="img" aria-label="View of the ${agent.name}"></canvas>
          <figcaption>${caption(agent.id)}</figcaption>
        </figure>`,
      )}
      <figure>
        <canvas class="map" width="480" height="480" role="img" aria-label="Map of the place with both agents"></canvas>
        <figcaption>Map${this.shown?.belief ? "; ring: believed position of the partner" : ""}</figcaption>
      </figure>
    </div>`;
  }

  private controls(info: ReplayInfo): TemplateResult {
    const fps = info.frames_per_second;
    const button = (label: string, icon: keyof typeof ICONS, action: () => void): TemplateResult =>
      html`<button type="button" aria-label=${label} title=${label} @click=${action}>
        <svg viewBox="0 0 20 20" aria-hidden="true">${svg`<path d=${ICONS[icon]}></path>`}</svg>
      </button>`;
    const [toggle, toggleIcon] = this.isPlaying
      ? (["Pause (space)", "pause"] as const)
      : (["Play (space)", "play"] as const);
    return html`<div class="controls" role="group" aria-label="Playback">
      ${button("Previous event ([)", "previous", () => this.jump(-1))}
      ${button("Previous frame (left arrow)", "back", () => this.seek(this.frame - 1))}
      ${button(toggle, toggleIcon, () => this.toggle())}
      ${button("Next frame (right arrow)", "forward", () => this.seek(this.frame + 1))}
      ${button("Next event (])", "next", () => this.jump(1))}
      <label>
        Speed
        <select @change=${(event: Event) => (this.speed = Number((event.target as HTMLSelectElement).value))}>
          ${SPEEDS.map((speed) => html`<option value=${speed} ?selected=${speed === this.speed}>${speed}x</option>`)}
        </select>
      </label>
      <label class="seek">
        <span class="hidden">Frame</span>
        <input
          type="range"
          min="0"
          max=${info.last_frame}
          .value=${String(this.frame)}
          aria-valuetext="${clock(this.frame, fps)} of ${clock(info.length, fps)}"
          @input=${(event: Event) => this.seek(Number((event.target as HTMLInputElement).value))}
        />
      </label>
      <span class="time">${clock(this.frame, fps)} / ${clock(info.length, fps)}, frame ${this.frame}</span>
      <span class="time">${this.shown?.done ?? 0} of ${info.total} delivered</span>
    </div>`;
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

/** Describes the limits of the partner. */
function limits(info: ReplayInfo): string {
  const partner = info.agents[0];
  if (!partner) return "";
  const [low, high] = partner.reach_m.map((m) => m.toFixed(2));
  return `The partner reaches from ${low} to ${high} m and lifts ${partner.strength_kg.toFixed(0)} kg.`;
}

/** Returns the side of the image that fills an element, in steps, pixels. */
function drawnSize(element: HTMLElement | undefined, max: number): number {
  const STEP = 64;
  const side = (element?.clientWidth ?? 0) * devicePixelRatio;
  return Math.min(Math.max(STEP * Math.ceil(side / STEP), STEP), max);
}

function legend(): TemplateResult {
  return html`<p class="legend">
    <span class="key walk"></span> walks <span class="key interact"></span> uses its hands
    <span class="key failed"></span> in vain (×) <span class="key wait"></span> waits
    <span class="key triangle">▼</span> delivery
  </p>`;
}

function paint(canvas: HTMLCanvasElement | undefined, { width, height, rgba }: Picture): void {
  const context = canvas?.getContext("2d");
  if (!canvas || !context) return;
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  context.putImageData(new ImageData(rgba, width, height), 0, 0);
}

customElements.define("chaic-replay", ChaicReplay);
