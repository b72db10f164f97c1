// Layers of the map of a replay: the truth, the memories of partner and helper, and the limits of the partner.

import { html, nothing, type ReactiveControllerHost, type TemplateResult } from "lit";
import { clock } from "./frames.js";
import { LIMIT_MARKS, limitsChart } from "./limits_chart.js";
import type { LayerData, Memory, Place, ReplayInfo, RerunInfo, RerunState } from "./messages.js";

/** Layers that a reader can show. */
type Layer = "truth" | "partner" | "helper" | "limits" | "explored" | "objects" | "paths";

const PARTNER = 0;
const HELPER = 1;
const NO_DATA: LayerData = { memories: [], objects: [] };

/** Names of the agents, and their colors on the map. */
const NAMES = ["partner", "helper"];
const COLORS = ["#b8341c", "#0b6e72"];
const HALO = "#fafaf8";
const INK = "#1e2026";
/** Colors of unknown, free and occupied cells over the truth and without it; red, green, blue and opacity. */
const OVER_TRUTH = [
  [30, 32, 38, 150],
  [0, 0, 0, 0],
  [0, 0, 0, 0],
];
const WITHOUT_TRUTH = [
  [190, 192, 196, 255],
  [250, 250, 248, 255],
  [70, 74, 82, 255],
];
/** Colors of cells that only one of two shown agents has seen. */
const ONLY = [
  [208, 64, 40, 70],
  [16, 136, 140, 70],
];
/** Minimum probability of a wanted object, per mille. */
const WANTED = 500;

/** Chosen layers with their data; draws them over a map. */
export class MapLayers {
  private readonly shown = new Set<Layer>(["truth", "explored", "objects", "paths"]);
  private data = NO_DATA;
  private rerun?: RerunState;

  /** `onChange` is called when other layers are chosen. */
  constructor(
    private readonly host: ReactiveControllerHost,
    private readonly onChange: () => void,
  ) {}

  /** Discards the data of the previous replay. */
  reset(): void {
    this.data = NO_DATA;
    this.rerun = undefined;
  }

  /** Agents whose memories are shown. */
  get memories(): number[] {
    return [PARTNER, HELPER].filter((agent) => this.shown.has(NAMES[agent] as Layer));
  }

  /** True if the limits of the partner are shown. */
  get withLimits(): boolean {
    return this.shown.has("limits");
  }

  /** Stores the progress of the agents; returns whether the shown frame must be drawn again. */
  advanced(state: RerunState, frame: number): boolean {
    this.rerun = state;
    this.host.requestUpdate();
    const isMissing = this.memories.length > this.data.memories.length;
    return isMissing && (state.frame > frame || state.is_complete);
  }

  /** Draws the layers over a map; the part below `mapHeight` widths is its legend. */
  draw(
    canvas: HTMLCanvasElement | undefined,
    map: { width: number; height: number },
    mapHeight: number,
    data: LayerData,
  ): void {
    this.data = data;
    this.host.requestUpdate();
    const context = canvas?.getContext("2d");
    if (!canvas || !context) return;
    canvas.width = map.width;
    canvas.height = map.height;
    // One unit is the width of the map.
    context.setTransform(map.width, 0, 0, map.width, 0, 0);
    if (!this.shown.has("truth")) {
      context.fillStyle = HALO;
      context.fillRect(0, 0, 1, map.height / map.width);
    }
    context.beginPath();
    context.rect(0, 0, 1, mapHeight);
    context.clip();
    if (this.shown.has("explored")) this.drawExplored(context, data.memories);
    for (const memory of data.memories) {
      if (this.shown.has("paths")) drawPath(context, memory);
      if (this.shown.has("objects")) drawObjects(context, memory);
    }
    for (const { at, limits } of data.objects) {
      drawText(context, [at[0] + 0.012, at[1]], limits.map((limit) => LIMIT_MARKS[limit].mark).join(""), INK);
    }
  }

  private drawExplored(context: CanvasRenderingContext2D, memories: Memory[]): void {
    const [first, second] = memories;
    if (!first) return;
    const isOverTruth = this.shown.has("truth");
    const colors = isOverTruth ? OVER_TRUTH : WITHOUT_TRUTH;
    const rows = first.cells.length / first.n_columns;
    const image = new ImageData(first.n_columns, rows);
    first.cells.forEach((cell, k) => {
      const other = second?.cells[k] ?? 0;
      const isOpen = isOverTruth || Math.max(cell, other) === 1;
      const isOfOne = second !== undefined && (cell === 0) !== (other === 0) && isOpen;
      const color = isOfOne ? ONLY[cell === 0 ? second.agent : first.agent]! : colors[Math.max(cell, other)]!;
      image.data.set(color, 4 * k);
    });
    const cells = new OffscreenCanvas(first.n_columns, rows);
    cells.getContext("2d")!.putImageData(image, 0, 0);
    context.imageSmoothingEnabled = false;
    const [x, y] = first.map_at;
    context.drawImage(cells, x, y, first.n_columns * first.cell, rows * first.cell);
  }

  /** Renders the controls that select layers. */
  choice(info: ReplayInfo): TemplateResult {
    const box = (layer: Layer, text: string): TemplateResult =>
      html`<label>
        <input type="checkbox" .checked=${this.shown.has(layer)} @change=${() => this.toggle(layer)} />
        ${text}
      </label>`;
    const hasHelper = info.agents.some((agent) => agent.id === HELPER);
    const details = [box("explored", "Explored area"), box("objects", "Remembered objects"), box("paths", "Planned paths")];
    return html`<fieldset class="layers">
      <legend>Layers of the map</legend>
      ${box("truth", "Truth")} ${box("partner", "What the partner knows")}
      ${hasHelper ? box("helper", "What the helper believes") : nothing} ${box("limits", "Limits of the partner")}
      ${this.memories.length > 0 ? details : nothing}
    </fieldset>`;
  }

  private toggle(layer: Layer): void {
    if (!this.shown.delete(layer)) this.shown.add(layer);
    this.onChange();
    this.host.requestUpdate();
  }

  /** Describes the shown layers in words, with the marks of the map. */
  words(info: ReplayInfo): TemplateResult | typeof nothing {
    if (this.memories.length === 0 && !this.withLimits) return nothing;
    const perSecond = info.frames_per_second;
    return html`<details class="words" open>
      <summary>The layers in words</summary>
      ${this.memories.length > 0 ? this.progress(perSecond) : nothing}
      ${this.memories.map((agent) => {
        const memory = this.data.memories.find((found) => found.agent === agent);
        return memory ? memoryInWords(memory, perSecond) : nothing;
      })}
      ${this.withLimits ? this.limitsInWords(info) : nothing}
    </details>`;
  }

  private progress(perSecond: number): TemplateResult {
    const { rerun } = this;
    const marks = html`<p class="small">
      Dark area: not seen. Circles: objects in the partner's memory; squares: in the helper's; dashed: not in view;
      filled: wanted with a probability of at least ${WANTED / 10} %. Diamonds: last known positions of people. Lines
      with a dot: planned paths, dashed for the helper.
    </p>`;
    if (!rerun?.is_complete) {
      const frame = rerun?.frame ?? 0;
      return html`<p>The agents run again beside the replay, up to ${clock(frame, perSecond)} so far.</p>
        ${marks}`;
    }
    return html`<p role="status">
        ${rerun.agents.filter(({ agent }) => this.memories.includes(agent)).map(agreement)}
      </p>
      ${marks}`;
  }

  private limitsInWords({ agents }: ReplayInfo): TemplateResult {
    const partner = agents[PARTNER]!;
    const [low, high] = partner.reach_m.map((m) => m.toFixed(2));
    const { objects } = this.data;
    const beyond = objects.filter((object) => object.limits.length > 0);
    return html`<p>
        <b>Limits</b>: the partner (${partner.person}) reaches tops from ${low} to ${high} m and lifts
        ${partner.strength_kg.toFixed(0)} kg.
      </p>
      ${limitsChart(partner, objects)}
      <p class="small">
        Objects of the task by mass and height of their tops. The region is what the partner can pick up; circles are in
        it.
      </p>
      <p>${beyond.length === 0 ? "No object of the task is beyond these limits." : "Beyond these limits:"}</p>
      <ul>
        ${beyond.map(
          ({ name, limits, top_m, mass_kg }) => html`<li>
            ${limits.map((limit) => LIMIT_MARKS[limit].mark)} ${name}: ${limits.map((limit) => LIMIT_MARKS[limit].text).join(", ")}
            (top at ${top_m.toFixed(2)} m, ${mass_kg.toFixed(1)} kg)
          </li>`,
        )}
      </ul>`;
  }
}

function agreement({ agent, is_available, n_equal, differs_at }: RerunInfo): TemplateResult {
  const name = NAMES[agent];
  if (!is_available) {
    return html`The ${name} cannot run in a page: a person, another process, or a network. Its memory is not shown. `;
  }
  const end = differs_at === null ? "" : ` It differs at frame ${differs_at}; nothing is shown from there on.`;
  return html`The ${name} runs again, and ${n_equal} of its actions equal the recorded ones.${end} `;
}

function memoryInWords(memory: Memory, perSecond: number): TemplateResult {
  const { agent, objects, people, path_m, plan, seen_m2, is_belief_equal } = memory;
  const wanted = objects.filter((object) => (object.wanted ?? 0) >= WANTED);
  const list = (names: string[]): string => (names.length > 0 ? names.join(", ") : "none");
  const known = people.map(([name, , frame]) => `${name} at ${clock(frame, perSecond)}`);
  return html`<p>
    <b>The ${NAMES[agent]}</b>, at its decision in frame ${memory.frame}: has seen ${seen_m2.toFixed(0)} m². Plan:
    ${plan || "none"}${path_m > 0 ? `, along a path of ${path_m.toFixed(1)} m` : ""}. Last saw people: ${list(known)}.
    ${wanted.length > 0 ? html`Probably wanted: ${list(wanted.map((object) => object.name))}.` : nothing}
    ${is_belief_equal === null
      ? nothing
      : is_belief_equal
        ? "Its belief equals the recorded one."
        : "Its belief differs from the recorded one."}
    <br />Remembers ${objects.length} objects: ${list(objects.map((object) => object.name))}.
  </p>`;
}

/** Strokes the current path in a color with a light border. */
function stroke(context: CanvasRenderingContext2D, color: string, dash: number[] = []): void {
  context.setLineDash([]);
  context.strokeStyle = HALO;
  context.lineWidth = 0.007;
  context.stroke();
  context.setLineDash(dash);
  context.strokeStyle = color;
  context.lineWidth = 0.0045;
  context.stroke();
  context.setLineDash([]);
}

function drawPath(context: CanvasRenderingContext2D, { agent, path }: Memory): void {
  const end = path.at(-1);
  if (!end) return;
  context.beginPath();
  path.forEach(([x, y]) => context.lineTo(x, y));
  stroke(context, COLORS[agent]!, agent === HELPER ? [0.016, 0.009] : []);
  context.beginPath();
  context.arc(end[0], end[1], 0.009, 0, 2 * Math.PI);
  context.fillStyle = COLORS[agent]!;
  context.fill();
}

function drawObjects(context: CanvasRenderingContext2D, { agent, frame, objects, people }: Memory): void {
  const SIDE = 0.02;
  const color = COLORS[agent]!;
  for (const { at, last_seen, wanted } of objects) {
    const [x, y] = at;
    context.beginPath();
    if (agent === HELPER) context.rect(x - SIDE / 2, y - SIDE / 2, SIDE, SIDE);
    else context.arc(x, y, SIDE / 2, 0, 2 * Math.PI);
    if ((wanted ?? 0) >= WANTED) {
      context.fillStyle = color;
      context.fill();
    }
    stroke(context, color, last_seen === frame ? [] : [0.006, 0.005]);
  }
  for (const [name, [x, y]] of people) {
    context.beginPath();
    for (const [dx, dy] of [[0, -SIDE], [SIDE, 0], [0, SIDE], [-SIDE, 0]] as Place[]) context.lineTo(x + dx, y + dy);
    context.closePath();
    stroke(context, color);
    drawText(context, [x - 0.008, y], name.slice(0, 1).toUpperCase(), color);
  }
}

/** Writes a text with a light border. */
function drawText(context: CanvasRenderingContext2D, [x, y]: Place, text: string, color: string): void {
  const { a: width } = context.getTransform();
  context.save();
  // Browsers refuse fonts of less than a pixel.
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.font = `bold ${Math.max(11, 0.026 * width).toFixed(0)}px sans-serif`;
  context.textBaseline = "middle";
  context.lineJoin = "round";
  context.lineWidth = 0.008 * width;
  context.strokeStyle = HALO;
  context.strokeText(text, x * width, y * width);
  context.fillStyle = color;
  context.fillText(text, x * width, y * width);
  context.restore();
}
