// Element <chaic-play>: an episode in which a person controls partner or helper.

import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from "lit";
import { property, query, state } from "lit/decorators.js";
import { repeat } from "lit/directives/repeat.js";
import { clock, delivered } from "./frames.js";
import type {
  Action,
  Branch,
  LiveConfig,
  LiveInfo,
  LiveState,
  Request,
  Response,
  Simulator,
  StoryLine,
} from "./messages.js";
import { drawnSize, MAX_PX, paint } from "./pictures.js";
import { Scanner } from "./scanner.js";
import { styles } from "./styles.js";
import { startWorker } from "./workers.js";

/** Side of the images in which a person points at objects, pixels. */
const POINTING_PX = 512;
/** Helpers whose results are shown beside the person's result. */
const REFERENCES = ["none", "rhp", "oracle"];
/** Simulated time between two parts of the trace that a study gets, frames. */
const RECORD_FRAMES = 15;

/** Episode to play, and its settings. */
export interface Game {
  /** Empty if a server simulates. */
  module: ArrayBuffer;
  /** Empty if a server simulates. */
  episode: Uint8Array;
  config: LiveConfig;
  /** True if the world goes on while the person thinks; otherwise it waits. */
  isLive: boolean;
  /** Simulated seconds per second. */
  speed: number;
  /** Recorded start of the episode, if the person takes over from a trace. */
  branch?: Branch;
  /** True in a study: the trace is passed on while it grows, and no results of others are shown. */
  isStudy?: boolean;
  /** Starts the simulator of a server, which stores the trace; otherwise a worker simulates. */
  startSimulator?: (receive: (response: Response) => void) => Simulator;
}

/** Result of a finished episode, for the page around it. */
export interface GameResult {
  trace: string;
  episode: Uint8Array;
}

type Hand = "left" | "right";

/** Episode that a person plays. Set `game` and `workerSource`. */
export class ChaicPlay extends LitElement {
  static override styles = styles;

  @property({ attribute: false }) game?: Game;
  /** Program of the worker. */
  @property({ attribute: false }) workerSource = "";

  @state() private info?: LiveInfo;
  @state() private shown?: LiveState;
  @state() private story: StoryLine[] = [];
  @state() private problem?: string;
  @state() private references = new Map<string, number>();
  /** Action of a click on the picture. */
  @state() private pointing: { kind: "pick_up" | "put_on" | "remove_obstacle"; hand: Hand } = {
    kind: "pick_up",
    hand: "left",
  };

  @query("canvas") private canvas?: HTMLCanvasElement;

  private simulator?: Simulator;
  private isBusy = false;
  /** True after the end of the episode, or after the person has stopped. */
  @state() private isOver = false;
  private input?: { plan: string } | { action: Action };
  private lastTime = 0;
  private elapsedFrames = 0;
  private readonly scanner = new Scanner(this, () => this.choices());
  private recordedFrame = 0;
  /** Number of requests for the trace without a response. */
  private nTraceRequests = 0;

  override connectedCallback(): void {
    super.connectedCallback();
    // The page moves the focus here when a person starts a game.
    this.tabIndex = -1;
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.close();
  }

  override updated(changed: PropertyValues<this>): void {
    if (changed.has("game") && this.game) this.open(this.game);
  }

  private close(): void {
    this.simulator?.close();
    this.simulator = undefined;
    this.scanner.stop();
    this.info = this.shown = this.problem = undefined;
    this.story = [];
    this.references = new Map();
    this.isOver = false;
    this.recordedFrame = this.nTraceRequests = 0;
  }

  private open(game: Game): void {
    this.close();
    const receive = (response: Response): void => this.receive(response);
    this.simulator = game.startSimulator?.(receive) ?? this.startWorker(receive);
    const { module, episode, config, branch } = game;
    this.post({ type: "play", module, episode, config: { ...config, is_live: game.isLive }, branch });
  }

  private startWorker(receive: (response: Response) => void): Simulator {
    const worker = startWorker(this.workerSource, receive, (message) => this.fail(message));
    return { post: (request) => worker.postMessage(request), close: () => worker.terminate() };
  }

  private post(request: Request): void {
    this.isBusy = true;
    this.simulator?.post(request);
  }

  private receive(response: Response): void {
    this.isBusy = false;
    switch (response.type) {
      case "playing":
        this.info = response.info;
        void this.updateComplete.then(() => this.begin());
        break;
      case "live":
        this.show(response.state);
        paint(this.canvas, response.view);
        break;
      case "trace":
        this.nTraceRequests -= 1;
        // A study takes no records of an episode that has failed.
        if (this.game?.isStudy && !this.problem) this.record(response.trace);
        if (this.isOver && this.nTraceRequests === 0) this.finish(response.trace);
        break;
      case "reference":
        this.references = new Map(this.references).set(response.helper, response.rate);
        this.compareNext();
        break;
      case "over":
        this.isOver = true;
        this.dispatchEvent(new CustomEvent("over", { detail: "ended" }));
        break;
      case "error":
        this.fail(response.message);
        break;
    }
  }

  private fail(problem: string): void {
    // Later problems follow from the first one.
    this.problem ??= problem;
    // A study goes on with the next episode; the trace of another game is offered as far as it goes.
    if (this.game?.isStudy) this.dispatchEvent(new CustomEvent("over", { detail: "left" }));
    else if (this.shown) this.stop();
  }

  private begin(): void {
    this.lastTime = performance.now();
    this.elapsedFrames = 1;
    requestAnimationFrame((time) => this.advance(time));
  }

  private advance(time: number): void {
    if (!this.simulator || this.problem || this.isOver) return;
    // A tab in the background gets no callbacks; the episode goes on where it was.
    const framesPerSecond = (this.game?.speed ?? 1) * (this.info?.frames_per_second ?? 0);
    this.elapsedFrames += (Math.min(time - this.lastTime, 250) / 1000) * framesPerSecond;
    // The world pauses while a picture takes longer than a second, for example without a connection to a server.
    this.elapsedFrames = Math.min(this.elapsedFrames, Math.max(framesPerSecond, 1));
    this.lastTime = time;
    const isWaiting = this.shown?.status === "waiting" && !this.input && !this.game?.isLive;
    const frames = Math.floor(this.elapsedFrames);
    if (!this.isBusy && frames > 0 && (!isWaiting || this.input)) {
      this.elapsedFrames -= frames;
      const viewPx = drawnSize(this.canvas, MAX_PX.view);
      this.post({ type: "advance", frames, viewPx, input: this.input });
      // A decision is recorded at once.
      if (this.input) this.recordedFrame = -RECORD_FRAMES;
      this.input = undefined;
    } else if (isWaiting) {
      this.elapsedFrames = Math.min(this.elapsedFrames, 1);
    }
    requestAnimationFrame((next) => this.advance(next));
  }

  private show(shown: LiveState): void {
    const isNewTurn = shown.status === "waiting" && this.shown?.status !== "waiting";
    const isPlanFocused = this.shadowRoot?.activeElement?.closest(".plans") != null;
    // A plan stays where it is while the list changes in a live game.
    const kept = isNewTurn ? [] : (this.shown?.plans ?? []).filter((plan) => shown.plans.includes(plan));
    const added = shown.plans.filter((plan) => !kept.includes(plan));
    this.shown = { ...shown, plans: [...kept, ...added] };
    if (shown.events.length > 0) this.story = [...this.story, ...shown.events];
    if (shown.status === "ended") this.stop();
    else if (this.game?.isStudy && (isNewTurn || shown.frame - this.recordedFrame >= RECORD_FRAMES)) {
      this.recordedFrame = shown.frame;
      this.requestTrace();
    }
    void this.updateComplete.then(() => {
      // The focused plan may have left the list.
      if (isNewTurn || (isPlanFocused && !this.shadowRoot?.activeElement)) this.focusChoices();
    });
  }

  /** Moves the focus to the first plan, or to the game without plans, unless the person is elsewhere on the page. */
  private focusChoices(): void {
    const focused = document.activeElement;
    if (focused !== document.body && focused !== this) return;
    const section = this.shadowRoot?.querySelector<HTMLElement>("section");
    const within = this.shadowRoot?.activeElement;
    if (within && within !== section && !within.closest(".plans")) return;
    const plan = section?.querySelector<HTMLElement>(".plans button");
    if (plan) plan.focus();
    else section?.focus({ preventScroll: true });
  }

  /** Ends the game; its trace so far is complete. */
  private stop(): void {
    if (this.isOver) return;
    this.isOver = true;
    this.scanner.stop();
    this.requestTrace();
  }

  private requestTrace(): void {
    this.nTraceRequests += 1;
    // The trace of a study is passed on in parts, since its length grows with the episode.
    this.post({ type: "trace", isPartial: this.game?.isStudy ?? false });
  }

  /** Passes on the new lines of the trace. */
  private record(added: string): void {
    if (added) this.dispatchEvent(new CustomEvent<string>("recorded", { detail: added }));
  }

  private finish(trace: string): void {
    const { episode, isStudy } = this.game!;
    if (isStudy) {
      const outcome = this.shown?.status === "ended" ? "ended" : "stopped";
      this.dispatchEvent(new CustomEvent("over", { detail: outcome }));
      return;
    }
    this.dispatchEvent(new CustomEvent<GameResult>("finished", { detail: { trace, episode } }));
    if (this.shown?.status === "ended") this.compareNext();
  }

  /** Plays the next reference helper on the same episode and seed. */
  private compareNext(): void {
    const helper = REFERENCES.find((name) => !this.references.has(name));
    if (helper) this.post({ type: "reference", helper });
  }

  private choose(index: number): void {
    const plan = this.shown?.plans[index];
    if (this.shown?.status === "waiting" && !this.isOver && plan !== undefined) this.input = { plan };
  }

  private act(action: Action): void {
    if (this.shown?.status === "waiting") this.input = { action };
  }

  private point(event: MouseEvent): void {
    if (this.game?.config.level !== "steps") return;
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    const at = (offset: number, size: number): number =>
      Math.max(0, Math.min(POINTING_PX - 1, Math.floor((offset / size) * POINTING_PX)));
    const pixel = { column: at(event.clientX - box.left, box.width), row: at(event.clientY - box.top, box.height) };
    const { kind, hand } = this.pointing;
    const subject = { pick_up: "object", put_on: "place", remove_obstacle: "obstacle" }[kind];
    this.act({ [kind]: { [subject]: { pixel }, hand } });
  }

  private press(event: KeyboardEvent): void {
    const target = event.composedPath()[0] as HTMLElement;
    if (event.ctrlKey || event.altKey || event.metaKey || target.matches("select, input")) return;
    const isSteps = this.game?.config.level === "steps";
    // A key that is held down chooses one plan only, not further plans in the next turns.
    const digit = /^[1-9]$/.test(event.key) && !event.repeat ? Number(event.key) - 1 : undefined;
    const steps: Record<string, Action> = {
      ArrowUp: "move_forward",
      ArrowLeft: "turn_left",
      ArrowRight: "turn_right",
      ".": { wait: { frames: 10 } },
    };
    const action = isSteps ? steps[event.key] : undefined;
    if (action) this.act(action);
    else if (!isSteps && digit !== undefined) this.choose(digit);
    else return;
    event.preventDefault();
  }

  /** Returns what a person with one switch can choose: the plans, the end of the game, and to go on without the switch. */
  private choices(): HTMLElement[] {
    return [...this.shadowRoot!.querySelectorAll<HTMLElement>(".plans button, button.link, input.scan")];
  }

  override render(): TemplateResult {
    const { info, shown } = this;
    if (this.problem) return html`<p class="problem" role="alert">Cannot play: ${this.problem}</p>`;
    if (!info) return this.isOver ? html`` : html`<p role="status">Loading ...</p>`;
    const inputs = this.game?.config.level === "plans" ? this.plans(shown) : this.steps(shown);
    return html`<section aria-label="Play" tabindex="-1" @keydown=${(event: KeyboardEvent) => this.press(event)}>
      ${this.heading(info)}
      <div class="columns">
        <figure class="a${this.game?.config.seat ?? 0}">
          <canvas
            class="view"
            width="512"
            height="512"
            role="img"
            aria-label="What you see"
            @click=${(event: MouseEvent) => this.point(event)}
          ></canvas>
        </figure>
        <div>
          ${shown ? this.status(shown) : nothing}
          ${this.isOver
            ? nothing
            : html`${inputs}
                <p><button type="button" class="link" @click=${() => this.stop()}>Stop here</button></p>`}
          ${shown?.status === "ended" && !this.game?.isStudy ? this.result(shown) : nothing} ${this.events()}
        </div>
      </div>
    </section>`;
  }

  private heading(info: LiveInfo): TemplateResult {
    const isHelper = this.game?.config.seat === 1;
    const [low, high] = info.reach_m.map((m) => m.toFixed(2));
    const goal = isHelper
      ? "The partner wants something that you do not know. Find out and help."
      : `Your body: ${info.person}. You want ${info.goal.join(", ")}.`;
    return html`<header>
      <h2>${info.task}: you are the ${isHelper ? "helper" : "partner"}</h2>
      <p>${goal} You reach from ${low} to ${high} m and lift ${info.strength_kg.toFixed(0)} kg.</p>
      <p class="small">${info.episode ? `${info.episode}. ` : ""}A simulation: real people differ from these bodies and views.</p>
    </header>`;
  }

  private time(frame: number): string {
    return clock(frame, this.info?.frames_per_second ?? 1);
  }

  private status(shown: LiveState): TemplateResult {
    const { action, plan } = shown.caption;
    const hands = shown.hands.map((held) => held ?? "nothing");
    const progress = shown.progress ? `, ${delivered(...shown.progress, this.info?.unit ?? "")}` : "";
    const refused = shown.is_refused ? "Your last choice was no longer possible. Choose again." : "";
    return html`<p class="time">
        ${this.time(shown.frame)} of ${this.time(shown.horizon)}${progress}
      </p>
      <p>Left hand: ${hands[0]}; right hand: ${hands[1]}</p>
      <p role="status">You: ${action}${plan ? ` (${plan})` : ""}${shown.failure ? `; failed: ${shown.failure}` : ""}</p>
      <p role="status">${this.isOver ? "The game has ended." : refused}</p>`;
  }

  private plans(shown: LiveState | undefined): TemplateResult {
    return html`<h3>What next?</h3>
      <ol class="plans">
        ${repeat(
          shown?.plans ?? [],
          (plan) => plan,
          (plan, k) =>
            html`<li><button type="button" @click=${() => this.choose(k)}>${plan}</button></li>`,
        )}
      </ol>
      ${shown?.status === "running" ? html`<p>Doing it ...</p>` : nothing}
      ${this.game?.isStudy ? nothing : this.scanner.controls("Offer one plan after the other, for a single switch")}`;
  }

  private steps(shown: LiveState | undefined): TemplateResult {
    const button = (label: string, action: Action): TemplateResult =>
      html`<button type="button" @click=${() => this.act(action)}>${label}</button>`;
    const change = (event: Event): void => {
      const [kind, hand] = (event.target as HTMLSelectElement).value.split(" ");
      this.pointing = { kind: kind as "pick_up", hand: hand as Hand };
    };
    const choices = [
      ["pick_up left", "picks up with the left hand"],
      ["pick_up right", "picks up with the right hand"],
      ["put_on left", "puts what the left hand holds there"],
      ["put_on right", "puts what the right hand holds there"],
      ["remove_obstacle left", "removes an obstacle"],
    ];
    return html`<div class="controls" role="group" aria-label="Actions">
        ${button("Turn left (left arrow)", "turn_left")} ${button("Walk (up arrow)", "move_forward")}
        ${button("Turn right (right arrow)", "turn_right")} ${button("Put into the container", "put_in")}
        ${button("Wait (.)", { wait: { frames: 10 } })}
      </div>
      <label>
        A click on the picture
        <select @change=${change}>
          ${choices.map(([value, text]) => html`<option value=${value!}>${text}</option>`)}
        </select>
      </label>
      ${shown?.status === "running" ? html`<p>Acting ...</p>` : nothing}`;
  }

  private result(shown: LiveState): TemplateResult {
    const [done, total] = shown.progress ?? [0, 0];
    const own = total > 0 ? done / total : 0;
    const percent = (rate: number | undefined): string => (rate === undefined ? "..." : `${(100 * rate).toFixed(0)} %`);
    const seat = this.game?.config.seat === 1 ? "your help" : "you as the partner";
    return html`<h3>Result</h3>
      <table>
        <caption>Delivered part of the goal, same episode and seed</caption>
        <tr><th scope="row">${seat}</th><td class="number">${percent(own)}</td></tr>
        ${REFERENCES.map(
          (name) => html`<tr>
            <th scope="row">simulated partner, ${name === "none" ? "no helper" : `helper ${name}`}</th>
            <td class="number">${percent(this.references.get(name))}</td>
          </tr>`,
        )}
      </table>`;
  }

  private events(): TemplateResult {
    return html`<div class="story">
      <h3>Events</h3>
      <ol reversed>
        ${[...this.story].reverse().map(
          (line) => html`<li><span class="time">${this.time(line.frame)}</span> ${line.text}</li>`,
        )}
      </ol>
    </div>`;
  }
}

customElements.define("chaic-play", ChaicPlay);
