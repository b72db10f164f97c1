// Element <chaic-compare>: two runs of one episode on one clock.

import { html, LitElement, nothing, svg, type PropertyValues, type TemplateResult } from "lit";
import { property, query, queryAll, state } from "lit/decorators.js";
import { badge } from "./badge.js";
import { PlaybackClock } from "./clock.js";
import { controls } from "./controls.js";
import { doneAt, firstDifference, progressPath } from "./difference.js";
import { clock, delivered } from "./frames.js";
import type { DecisionLine, FrameState, ReplayInfo } from "./messages.js";
import { drawnSize, MAX_PX, paint, paintMap } from "./pictures.js";
import { ReplayPlayer, type DrawnFrame, type Source } from "./player.js";
import { styles } from "./styles.js";
import { timeline } from "./timeline.js";
import { WidthObserver } from "./width.js";

const PARTNER = 0;
const HELPER = 1;

/** Two replays of one episode. Set `sources` and `workerSource`. */
export class ChaicCompare extends LitElement {
  static override styles = styles;

  /** Both runs. */
  @property({ attribute: false }) sources?: [Source, Source];
  /** Program of the workers. */
  @property({ attribute: false }) workerSource = "";
  /** Frame that is shown first. */
  @property({ type: Number }) start = 0;

  @state() private infos: (ReplayInfo | undefined)[] = [];
  @state() private shown: (FrameState | undefined)[] = [];
  @state() private problem?: string;
  /** Agent whose views are drawn. */
  @state() private viewer = HELPER;

  @queryAll("canvas.view") private viewCanvases!: NodeListOf<HTMLCanvasElement>;
  @query("canvas.map") private mapCanvas?: HTMLCanvasElement;

  private players: ReplayPlayer[] = [];
  private readonly playback = new PlaybackClock(
    this,
    (frame) => this.moved(frame),
    () => this.players.length === 0 || this.players.some((player) => player.isDrawing),
  );

  constructor() {
    super();
    new WidthObserver(this, () => this.redraw());
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.close();
  }

  override updated(changed: PropertyValues<this>): void {
    if (!changed.has("sources")) return;
    this.close();
    this.sources?.forEach((source, run) => this.open(run, source));
  }

  /** Shows a frame and stops. If the replays are not verified yet, it is the first frame shown. */
  seek(frame: number): void {
    if (!this.infos[0] || !this.infos[1]) this.start = frame;
    this.playback.seek(frame);
  }

  /** Shown frame. */
  get frame(): number {
    return this.playback.frame;
  }

  private close(): void {
    this.players.forEach((player) => player.close());
    this.players = [];
    this.infos = [];
    this.shown = [];
    this.problem = undefined;
    this.playback.reset();
  }

  private open(run: number, source: Source): void {
    const informed = (info: ReplayInfo): void => {
      if (!info.is_complete) return;
      this.infos = replaced(this.infos, run, info);
      const [a, b] = this.infos;
      if (a && b) this.begin(a, b);
    };
    // The first run draws the map of both.
    const wanted = () => ({
      agents: [this.viewer],
      viewPx: drawnSize(this.viewCanvases[0], MAX_PX.view),
      mapPx: run === 0 ? drawnSize(this.mapCanvas, MAX_PX.map) : 0,
      memories: [],
      withLimits: false,
    });
    const drawn = ({ state: shown, views, map }: DrawnFrame) => {
      this.shown = replaced(this.shown, run, shown);
      if (views[0]) paint(this.viewCanvases[run], views[0]);
      if (map) paintMap(this.mapCanvas, map);
    };
    const failed = (message: string): void => {
      this.problem = message;
    };
    this.players[run] = new ReplayPlayer(this.workerSource, source, wanted, informed, drawn, failed);
  }

  private begin(a: ReplayInfo, b: ReplayInfo): void {
    if (a.episode !== b.episode || a.seed !== b.seed) {
      this.problem = "the runs are not of the same episode and seed";
      return;
    }
    const haveHelpers = [a, b].every((info) => info.agents.some((agent) => agent.id === HELPER && info.helper !== "none"));
    this.viewer = haveHelpers ? HELPER : PARTNER;
    const events = [a, b].flatMap((info) => info.timeline.story.map((line) => line.frame)).sort((x, y) => x - y);
    const last = Math.max(a.last_frame, b.last_frame);
    this.playback.reset({ last, perSecond: a.frames_per_second, events });
    void this.updateComplete.then(() => this.seek(this.start));
  }

  private moved(frame: number): void {
    this.players.forEach((player) => player.seek(frame));
    this.dispatchEvent(new CustomEvent("moved", { detail: frame }));
  }

  private redraw(): void {
    // The agents are known once both replays are open.
    if (!this.infos[0] || !this.infos[1]) return;
    this.players.forEach((player) => player.seek(this.frame));
  }

  override render(): TemplateResult {
    const [a, b] = this.infos;
    if (this.problem || !a || !b) {
      return html`<p role="status">${this.problem ? `Cannot compare: ${this.problem}` : "Replaying ..."}</p>`;
    }
    const runs: [ReplayInfo, ReplayInfo] = [a, b];
    const last = Math.max(a.last_frame, b.last_frame);
    return html`<section aria-label="Comparison" @keydown=${(event: KeyboardEvent) => this.playback.press(event)}>
      ${this.heading(runs)} ${this.pictures(runs)}
      ${controls(this.playback, last, a.frames_per_second, this.status(runs))}
      ${chart(runs, last, this.frame, (frame) => this.seek(frame))}
      ${runs.map(
        (info) => html`<h3>${label(info)}</h3>
          ${timeline(info, this.frame, (frame) => this.seek(frame), last)}`,
      )}
      <div class="columns">${runs.map((info) => this.story(info))}</div>
    </section>`;
  }

  private heading(runs: [ReplayInfo, ReplayInfo]): TemplateResult {
    const [a, b] = runs;
    const result = (info: ReplayInfo): TemplateResult =>
      html`<p>
        <b>${label(info)}</b>: ${delivered(doneAt(info.timeline.deliveries, info.last_frame), info.total, info.unit)}.
        ${badge(info)}
        ${info.problem
          ? html`<span class="problem" role="alert">
              Shown up to frame ${info.last_frame} of ${info.length}: ${info.problem}
            </span>`
          : nothing}
      </p>`;
    return html`<header>
      <h2>${a.task}: ${label(a)} and ${label(b)}</h2>
      ${runs.map(result)} ${this.difference(runs)}
      <p class="small">${a.episode}, seed ${a.seed}, chaic ${a.chaic}</p>
    </header>`;
  }

  private difference(runs: [ReplayInfo, ReplayInfo]): TemplateResult {
    const [a, b] = runs;
    const found = firstDifference(a, b);
    if (!found) return html`<p>Both runs are equal.</p>`;
    const names = a.agents.map((agent) => agent.name);
    const words = (line: DecisionLine | undefined): string =>
      line ? `the ${names[line.agent] ?? "agent"} ${line.text} (frame ${line.frame})` : "no more decisions";
    const [x, y] = found.decisions;
    return html`<p>
      First different decision:
      <button type="button" class="link" @click=${() => this.seek(found.frame)}>
        ${clock(found.frame, a.frames_per_second)}
      </button>
      <br />${label(a)}: ${words(x)}; ${label(b)}: ${words(y)}
    </p>`;
  }

  private pictures(runs: [ReplayInfo, ReplayInfo]): TemplateResult {
    const agents = runs[0].agents.filter((agent) => agent.id <= HELPER && runs[1].agents.some(({ id }) => id === agent.id));
    const choose = (event: Event): void => {
      this.viewer = Number((event.target as HTMLSelectElement).value);
      this.redraw();
    };
    const views = runs.map((info, run) => {
      const caption = this.shown[run]?.captions[this.viewer];
      return html`<figure class="run${run}">
        <canvas class="view" width="384" height="384" role="img" aria-label="View with ${label(info)}"></canvas>
        <figcaption>
          <b>${label(info)}</b>${caption ? html`: ${caption.action}<br />Plan: ${caption.plan || "none"}` : nothing}
        </figcaption>
      </figure>`;
    });
    return html`<p>
        <label>
          Views of the
          <select @change=${choose}>
            ${agents.map(
              (agent) => html`<option value=${agent.id} ?selected=${agent.id === this.viewer}>${agent.name}</option>`,
            )}
          </select>
        </label>
      </p>
      <div class="pictures">
        ${views}
        <figure>
          <div class="overlaid">
            <canvas class="map" width="480" height="480" role="img" aria-label="Map with the trails of both runs"></canvas>
            ${trails(runs, this.frame)}
          </div>
          <figcaption>Trails so far: solid with ${label(runs[0])}, dashed with ${label(runs[1])}; objects as with ${label(runs[0])}</figcaption>
        </figure>
      </div>`;
  }

  private status(runs: [ReplayInfo, ReplayInfo]): string {
    const done = runs.map((info) => doneAt(info.timeline.deliveries, this.frame));
    return delivered(done.join(" and "), runs[0].total, runs[0].unit);
  }

  private story(info: ReplayInfo): TemplateResult {
    return html`<div class="story">
      <h3>Events: ${label(info)}</h3>
      <ol>
        ${info.timeline.story.map(
          (line) => html`<li>
            <button type="button" @click=${() => this.seek(line.frame)}>
              <span class="time">${clock(line.frame, info.frames_per_second)}</span> ${line.text}
            </button>
          </li>`,
        )}
      </ol>
    </div>`;
  }
}

function label(info: ReplayInfo): string {
  const name = info.helper === "none" ? "no helper" : info.helper;
  return info.branch_at === null ? name : `${name} from ${clock(info.branch_at, info.frames_per_second)}`;
}

function replaced<T>(values: (T | undefined)[], index: number, value: T): (T | undefined)[] {
  const copy = [...values];
  copy[index] = value;
  return copy;
}

/** Draws the trails of partner and helper up to a frame over a map. */
function trails(runs: [ReplayInfo, ReplayInfo], frame: number): TemplateResult {
  const line = (info: ReplayInfo, run: number, agent: number): unknown => {
    const points = (info.trails[agent] ?? []).slice(0, 1 + Math.floor(frame / info.trail_interval));
    if (points.length === 0) return nothing;
    const [x, y] = points.at(-1)!;
    return svg`<polyline class="a${agent} run${run}" points=${points.join(" ")}></polyline>
      <circle class="a${agent} run${run}" cx=${x} cy=${y} r="0.012"></circle>`;
  };
  // Coordinates are in map widths; the SVG has the width of the map and an arbitrary height.
  return html`<svg class="trails" viewBox="0 0 1 4" preserveAspectRatio="xMidYMin slice" aria-hidden="true">
    ${runs.flatMap((info, run) => [PARTNER, HELPER].map((agent) => line(info, run, agent)))}
  </svg>`;
}

/** Draws the delivered fractions over time; `onSeek` receives the frame that a pointer selects. */
function chart(
  runs: [ReplayInfo, ReplayInfo],
  last: number,
  frame: number,
  onSeek: (frame: number) => void,
): TemplateResult {
  const seek = (event: PointerEvent): void => {
    const box = (event.currentTarget as Element).getBoundingClientRect();
    onSeek(((event.clientX - box.left) / box.width) * last);
  };
  return html`<h3>Delivered over time</h3>
    <svg class="chart" viewBox="0 -0.05 ${Math.max(last, 1)} 1.1" preserveAspectRatio="none" aria-hidden="true" @pointerdown=${seek}>
      ${runs.map((info, run) => svg`<path class="run${run}" d=${progressPath(info)}></path>`)}
      ${svg`<path class="now" d="M${frame} -0.05V1.05"></path>`}
    </svg>
    <p class="legend">From none to all; solid: ${label(runs[0])}, dashed: ${label(runs[1])}</p>`;
}

customElements.define("chaic-compare", ChaicCompare);
