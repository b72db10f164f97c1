// Page of a study: consent, instructions, practice, blocks with forms, debriefing. Everything is in the page, and the
// data stay in the browser until the participant downloads them.

import { html, LitElement, nothing, type TemplateResult } from "lit";
import { query, state } from "lit/decorators.js";
import { keyed } from "lit/directives/keyed.js";
import { embedded, moduleBytes, workerSource } from "./embedded.js";
import "./play.js";
import type { ChaicPlay, Game } from "./play.js";
import {
  checkpoint,
  openTrial,
  stepsOf,
  type DataRecord,
  type Ratings,
  type Step,
  type StudyContent,
  type TrialOutcome,
} from "./study/content.js";
import "./study/form.js";
import type { ChaicForm } from "./study/form.js";
import { lock, StudyLog } from "./study/log.js";
import { Scanner } from "./study/scanner.js";
import { paragraphs } from "./study/text.js";

/** Letters and digits of participant codes: those that are not mistaken for each other. */
const ALPHABET = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789";
const CODE_LENGTH = 10;

/** Draws a participant code. The alphabet has 32 characters, so all are equally likely. */
function drawCode(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(CODE_LENGTH));
  return Array.from(bytes, (byte) => ALPHABET[byte % ALPHABET.length]).join("");
}

/** The page of a study. It uses the styles of the page. */
export class ChaicStudy extends LitElement {
  @state() private content?: StudyContent;
  @state() private isLoading = true;
  /** Slot from 1; undefined if the address names none. */
  @state() private slotNumber?: number;
  @state() private log?: StudyLog;
  @state() private steps: Step[] = [];
  @state() private at = 0;
  /** State of the current trial. */
  @state() private playing: "before" | "running" | "over" = "before";
  @state() private isResumed = false;
  @state() private isScanning = false;
  @state() private hasLeft = false;
  @state() private problem?: string;

  @query("dialog") private dialog?: HTMLDialogElement;
  @query("chaic-play") private player?: ChaicPlay;
  @query("chaic-form") private form?: ChaicForm;

  private game?: Game;
  private module?: ArrayBuffer;
  private readonly scanner = new Scanner(() => this.choices());

  protected override createRenderRoot(): HTMLElement {
    return this;
  }

  override connectedCallback(): void {
    super.connectedCallback();
    addEventListener("hashchange", () => location.reload());
    addEventListener("unhandledrejection", (event) => this.fail(event.reason));
    void this.load().catch((problem: unknown) => this.fail(problem));
  }

  private fail(problem: unknown): void {
    this.problem = problem instanceof Error ? problem.message : String(problem);
  }

  private async load(): Promise<void> {
    const bytes = await embedded(document.getElementById("chaic-study")!);
    const content = JSON.parse(new TextDecoder().decode(bytes)) as StudyContent;
    const slot = /^#(\d{1,5})$/.exec(location.hash)?.[1];
    this.content = content;
    if (slot === undefined || !content.slots[Number(slot) - 1]) {
      this.isLoading = false;
      return;
    }
    this.slotNumber = Number(slot);
    this.steps = stepsOf(content, this.slotNumber);
    if (!(await lock(this.logName()))) {
      this.problem = "it is open in another tab. Go on there, or close that tab and load this page again.";
      return;
    }
    const log = await StudyLog.open(this.logName(), false);
    if (log?.records.length) await this.resume(log);
    this.isLoading = false;
  }

  private logName(): string {
    return `chaic-study-${this.content!.digest}-${this.slotNumber}`;
  }

  /** Goes on at the checkpoint. An episode that was running counts as left. */
  private async resume(log: StudyLog): Promise<void> {
    this.log = log;
    this.isResumed = true;
    const trial = openTrial(log.records);
    if (trial !== undefined) await log.append({ type: "trial_end", trial, outcome: "left" });
    this.at = checkpoint(this.steps, log.records);
  }

  /** The participant agrees: the log comes into being. */
  private async agree(): Promise<void> {
    const { format, version, chaic, digest } = this.content!;
    const log = await StudyLog.open(this.logName(), true);
    if (!log) return;
    const start = { format, version, chaic, study: digest, code: drawCode(), slot: this.slotNumber! };
    await log.append({ type: "start", ...start });
    this.log = log;
    this.focusHeading();
  }

  /** Stores a record and goes on to the next step. */
  private async advance(record?: DataRecord): Promise<void> {
    if (record) await this.log?.append(record);
    this.at += 1;
    this.playing = "before";
    this.game = undefined;
    this.isResumed = false;
    const isLast = this.steps[this.at]?.kind === "debrief";
    const isComplete = this.log?.records.some((known) => known.type === "complete");
    if (isLast && !isComplete) await this.log?.append({ type: "complete" });
    this.focusHeading();
  }

  /** Deletes all data and ends the participation. */
  private async leave(): Promise<void> {
    this.dialog?.close();
    // The episode stops first, so that it cannot append to a deleted log.
    this.playing = "before";
    this.game = undefined;
    const { log } = this;
    this.log = undefined;
    this.hasLeft = true;
    await log?.delete();
    this.focusHeading();
  }

  private focusHeading(): void {
    void this.updateComplete.then(() => {
      this.querySelector<HTMLElement>("h1")?.focus();
      scrollTo(0, 0);
    });
  }

  private code(): string {
    const [start] = this.log?.records ?? [];
    return start?.type === "start" ? start.code : "";
  }

  private async startTrial(step: Extract<Step, { kind: "trial" }>): Promise<void> {
    const { content, log } = this;
    if (!content || !log) return;
    this.module ??= await moduleBytes();
    const [, condition, episode, helper] = step.trial;
    const { seat, input } = content.conditions[condition]!;
    await log.append({ type: "trial", trial: step.number });
    this.game = {
      module: this.module,
      episode: new TextEncoder().encode(content.episodes[episode]!),
      config: { seed: content.seed, seat: seat === "partner" ? 0 : 1, level: input, helper },
      isLive: content.play.world === "goes_on",
      speed: content.play.speed,
      isStudy: true,
    };
    this.playing = "running";
  }

  private endTrial(trial: number, outcome: TrialOutcome): void {
    void this.log?.append({ type: "trial_end", trial, outcome }).then(() => {
      this.playing = "over";
      void this.updateComplete.then(() => this.querySelector<HTMLElement>("#continue")?.focus());
    });
  }

  private download(): void {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([this.log?.toText() ?? ""], { type: "application/jsonl" }));
    link.download = `${this.code()}.jsonl`;
    link.click();
    URL.revokeObjectURL(link.href);
  }

  /** Returns the choices that are offered to a person with one switch. */
  private choices(): HTMLElement[] {
    const visible = (root: ParentNode, selector: string): HTMLElement[] =>
      [...root.querySelectorAll<HTMLElement>(selector)].filter((element) => element.checkVisibility());
    if (this.dialog?.open) return visible(this.dialog, "button");
    const stop = visible(this, "#leave");
    if (this.form) return [...this.form.nextInputs(), ...stop];
    const played = this.playing === "running" ? this.player?.shadowRoot : undefined;
    const plans = played ? visible(played, ".plans button, .controls button, button.link") : [];
    return [...plans, ...visible(this, ".step > p > button"), ...stop];
  }

  private press(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (event.key !== "Enter" || !target.matches("input[type=radio], input[type=checkbox]")) return;
    // Enter would send the form.
    event.preventDefault();
    target.click();
  }

  override render(): TemplateResult {
    const progress = this.log ? `Part ${this.at + 1} of ${this.steps.length}` : "";
    return html`<div class="study" @keydown=${(event: KeyboardEvent) => this.press(event)}>
      ${this.bar()}
      <section class="step">
        ${this.problem
          ? html`<p class="problem" role="alert">The study cannot go on: ${this.problem}</p>`
          : nothing}
        <p class="small" role="status">${progress}</p>
        ${this.current()}
      </section>
      ${this.question()}
    </div>`;
  }

  private bar(): TemplateResult {
    const scan = (event: Event): void => {
      this.isScanning = (event.target as HTMLInputElement).checked;
      this.scanner.set(this.isScanning);
    };
    return html`<div class="bar" role="group" aria-label="Study">
      <label title="Offers one choice after the other; Enter or space takes it">
        <input type="checkbox" .checked=${this.isScanning} @change=${scan} />
        One switch
      </label>
      <button type="button" id="leave" ?disabled=${this.hasLeft} @click=${() => this.dialog?.showModal()}>
        Stop and delete
      </button>
    </div>`;
  }

  private question(): TemplateResult {
    return html`<dialog aria-labelledby="leave-title">
      <h2 id="leave-title">Stop and delete?</h2>
      <p>The study ends, and all your data in this browser are deleted.</p>
      <p>
        <button type="button" @click=${() => void this.leave()}>Delete and stop</button>
        <button type="button" @click=${() => this.dialog?.close()}>Go on with the study</button>
      </p>
    </dialog>`;
  }

  private current(): TemplateResult {
    const { content } = this;
    if (!content || this.isLoading) return this.problem ? html`` : html`<p role="status">Loading ...</p>`;
    if (this.hasLeft) {
      return html`${this.heading("You have stopped")}
        <p>All your data in this browser are deleted. You may close this page.</p>`;
    }
    if (this.slotNumber === undefined) return this.slotQuestion(content);
    if (!this.log) return this.consent(content);
    const step = this.steps[this.at]!;
    switch (step.kind) {
      case "instructions":
        return this.instructions(content);
      case "trial":
        return this.trial(step);
      case "form":
        return this.questions(content, step);
      case "debrief":
        return this.debrief(content);
    }
  }

  private heading(text: string): TemplateResult {
    return html`<h1 tabindex="-1">${text}</h1>`;
  }

  private slotQuestion({ title, slots }: StudyContent): TemplateResult {
    const open = (event: Event): void => {
      event.preventDefault();
      const number = new FormData(event.target as HTMLFormElement).get("slot");
      location.hash = `#${Number(number)}`;
    };
    return html`${this.heading(title)}
      <form @submit=${open}>
        <label>
          Your participant number, 1 to ${slots.length}
          <input type="number" name="slot" min="1" max=${slots.length} required />
        </label>
        <button>Continue</button>
      </form>`;
  }

  private consent({ title, consent }: StudyContent): TemplateResult {
    return html`${this.heading(title)} ${paragraphs(consent)}
      <p class="small">Nothing is stored before you agree.</p>
      <p>
        <button type="button" @click=${() => void this.agree()}>I agree and take part</button>
        <button type="button" @click=${() => void this.leave()}>I do not take part</button>
      </p>`;
  }

  private instructions({ instructions }: StudyContent): TemplateResult {
    return html`${this.heading("Instructions")} ${paragraphs(instructions)}
      <p>Your code is <b class="code">${this.code()}</b>. Keep it: with it, the researchers can delete your data later.</p>
      <p><button type="button" @click=${() => void this.advance({ type: "instructed" })}>Continue</button></p>`;
  }

  private trial(step: Extract<Step, { kind: "trial" }>): TemplateResult {
    const trials = this.steps.filter((other) => other.kind === "trial");
    const isPractice = step.trial[0] === 0;
    const title = `Episode ${step.number + 1} of ${trials.length}${isPractice ? ", practice" : ""}`;
    if (this.playing === "before") {
      return html`${this.heading(title)}
        ${this.isResumed ? html`<p>The study goes on here. An episode that was interrupted is not repeated.</p>` : nothing}
        <p>${isPractice ? "This episode is for practice." : "This episode counts."}</p>
        <p><button type="button" @click=${() => void this.startTrial(step)}>Start the episode</button></p>`;
    }
    return html`${this.heading(title)}
      <chaic-play
        .workerSource=${workerSource()}
        .game=${this.game}
        @recorded=${(event: CustomEvent<string>) =>
          void this.log?.append({ type: "trace", trial: step.number, text: event.detail })}
        @over=${(event: CustomEvent<TrialOutcome>) => this.endTrial(step.number, event.detail)}
      ></chaic-play>
      ${this.playing === "over"
        ? html`<p>The episode is over. <button type="button" id="continue" @click=${() => void this.advance()}>Continue</button></p>`
        : nothing}`;
  }

  private questions(content: StudyContent, step: Extract<Step, { kind: "form" }>): TemplateResult {
    const form = content.forms[step.name]!;
    const answered = (event: CustomEvent<Ratings>): void => {
      const { position, name } = step;
      void this.advance({ type: "answers", position, form: name, ratings: event.detail });
    };
    // The next form starts without answers.
    return html`${this.heading(form.title)}
      ${keyed(
        `${step.position} ${step.name}`,
        html`<chaic-form .form=${form} .other=${step.other} @answered=${answered}></chaic-form>`,
      )}`;
  }

  private debrief({ debrief, completion_code }: StudyContent): TemplateResult {
    return html`${this.heading("The end")} ${paragraphs(debrief)}
      <p>Completion code: <b class="code">${completion_code}</b></p>
      <p>Your code: <b class="code">${this.code()}</b>. With it, the researchers can delete your data.</p>
      <p>
        <button type="button" @click=${() => this.download()}>Download your data</button>
      </p>
      <p class="small">The file has your answers and your decisions. It has no name, no address and no times of day.
        "Stop and delete" removes the copy in this browser.</p>`;
  }
}

customElements.define("chaic-study", ChaicStudy);
