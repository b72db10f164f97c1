// Page of a study: consent, instructions, practice, blocks with forms, debriefing. Everything is in the page, unless the
// server simulates the episodes. The data stay in the browser until the participant downloads them; the page of a server
// also sends them to it.

import { html, LitElement, nothing, type TemplateResult } from "lit";
import { query, state } from "lit/decorators.js";
import { keyed } from "lit/directives/keyed.js";
import { embedded, moduleBytes, workerSource } from "./embedded.js";
import "./play.js";
import { Scanner } from "./scanner.js";
import type { Response, Simulator } from "./messages.js";
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
import { lock, StudyLog, type Identity } from "./study/log.js";
import { drawToken, Participant, Upload } from "./study/server.js";
import { ServerSimulator } from "./study/simulator.js";
import { paragraphs } from "./study/text.js";

/** Letters and digits of participant codes, without those that look alike. */
const ALPHABET = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789";
const CODE_LENGTH = 10;
/** Time for which a browser can read a downloaded file, milliseconds. */
const KEPT_DOWNLOAD_MS = 60_000;

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
  @state() private hasLeft = false;
  /** True while a step is stored. */
  private isChanging = false;
  /** Last trial that has ended. */
  private endedTrial?: number;
  @state() private problem?: string;
  /** State of a participation with a server, beside those of any. */
  @state() private waits?: "entry" | "full" | "deletion" | "removed";

  @query("dialog") private dialog?: HTMLDialogElement;
  @query("chaic-play") private player?: ChaicPlay;
  @query("chaic-form") private form?: ChaicForm;

  private game?: Game;
  private module?: ArrayBuffer;
  /** Log of a participant who has agreed and whom the server may not know yet. */
  private entering?: { log: StudyLog; participant: Participant };
  private upload?: Upload;
  private participant?: Participant;
  /** True while an episode waits for the connection to the server. */
  @state() private isConnectionLost = false;
  /** True while the deletion of the log waits for another tab. */
  @state() private isDeletionBlocked = false;
  /** True if the server did not send the data. */
  @state() private hasDownloadFailed = false;
  private readonly scanner = new Scanner(this, () => this.choices());

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
    this.content = content;
    if (!content.server && !this.takeSlot(Number(/^#(\d{1,5})$/.exec(location.hash)?.[1]))) {
      this.isLoading = false;
      return;
    }
    if (!(await lock(this.logName()))) {
      this.problem = "it is open in another tab. Go on there, or close that tab and load this page again.";
      return;
    }
    const log = await StudyLog.open(this.logName(), false);
    const identity = await log?.readIdentity();
    if (log && identity) await this.resumeWithServer(log, identity);
    else if (log?.records.length) await this.resume(log);
    this.isLoading = false;
  }

  /** Takes a slot from 1; returns false if the study has none of this number. */
  private takeSlot(slot: number): boolean {
    if (!this.content?.slots[slot - 1]) return false;
    this.slotNumber = slot;
    this.steps = stepsOf(this.content, slot);
    return true;
  }

  private logName(): string {
    const { digest, server } = this.content!;
    return `chaic-study-${digest}-${server ? "server" : this.slotNumber}`;
  }

  /** Continues a participation that a server stores: at the entry, at the checkpoint, or with the deletion. */
  private async resumeWithServer(log: StudyLog, identity: Identity): Promise<void> {
    const [start] = log.records;
    if (identity.isLeaving) {
      this.hasLeft = true;
      this.waits = "deletion";
      void this.deleteEverywhere(log, identity).then(() => (this.waits = undefined));
    } else if (start?.type !== "start") {
      void this.enter(log, identity);
    } else {
      this.takeSlot(start.slot);
      this.startUpload(log, new Participant(identity), undefined);
      await this.resume(log);
    }
  }

  private startUpload(log: StudyLog, participant: Participant, stored: number | undefined): void {
    const changed = (): void => {
      if (this.upload?.state === "refused") {
        this.fail(`${this.upload.problem}. Your data are kept in this browser.`);
      }
      this.requestUpdate();
    };
    this.participant = participant;
    this.upload = new Upload(participant, log, stored, this.isSimulatedByServer(), changed);
    void this.upload.send();
  }

  private isSimulatedByServer(): boolean {
    return this.content?.play.simulator === "server";
  }

  /** Appends a record to the log, and sends it to the server if there is one. */
  private async store(record: DataRecord): Promise<void> {
    await this.log?.append(record);
    void this.upload?.send();
  }

  /** Continues at the checkpoint. An episode that was running goes on if the server has it, and counts as left otherwise. */
  private async resume(log: StudyLog): Promise<void> {
    this.log = log;
    this.isResumed = true;
    const trial = openTrial(log.records);
    if (trial !== undefined && !this.isSimulatedByServer()) await this.store({ type: "trial_end", trial, outcome: "left" });
    this.at = checkpoint(this.steps, log.records);
    await this.completeAtEnd();
  }

  /** Runs a change of the state; a second click before its end has no effect. */
  private async once(change: () => Promise<void>): Promise<void> {
    if (this.isChanging) return;
    this.isChanging = true;
    try {
      await change();
    } finally {
      this.isChanging = false;
    }
  }

  /** Creates the log after the participant has agreed. */
  private async agree(): Promise<void> {
    const { format, version, chaic, digest, server } = this.content!;
    // Without storage, the page stays at the consent and shows the reason.
    const log = await StudyLog.open(this.logName(), true);
    if (!log) return;
    this.problem = undefined;
    if (this.hasLeft) {
      await this.deleteLog(log);
      return;
    }
    if (server) {
      await this.enter(log);
      return;
    }
    const start = { format, version, chaic, study: digest, code: drawCode(), slot: this.slotNumber! };
    await log.append({ type: "start", ...start });
    this.log = log;
    this.focusHeading();
  }

  /** Asks the server for a slot. After a lost answer, it repeats the request with the same identity, also after a reload. */
  private async enter(log: StudyLog, known?: Identity): Promise<void> {
    const identity = known ?? { code: drawCode(), token: drawToken(), isLeaving: false };
    if (!known) await log.setIdentity(identity);
    const participant = new Participant(identity);
    this.entering = { log, participant };
    this.waits = "entry";
    const entry = await participant.enter();
    if (entry === "aborted" || this.hasLeft) return;
    if (entry === "taken") {
      await this.enter(log);
    } else if (entry === "full") {
      this.entering = undefined;
      await this.deleteLog(log);
      this.waits = "full";
      this.focusHeading();
    } else if (entry.start.type === "start" && this.takeSlot(entry.start.slot)) {
      await log.append(entry.start);
      // "Stop and delete" during this has deleted the record as well.
      if (this.hasLeft) return;
      this.entering = undefined;
      this.waits = undefined;
      this.log = log;
      this.startUpload(log, participant, entry.stored);
      this.focusHeading();
    }
  }

  /** Stores a record and goes on to the next step. */
  private async advance(record?: DataRecord): Promise<void> {
    if (record) await this.store(record);
    this.at += 1;
    this.playing = "before";
    this.game = undefined;
    this.isResumed = false;
    await this.completeAtEnd();
    this.focusHeading();
  }

  /** Stores once that the participant has reached the debriefing, also by a reload after the last episode. */
  private async completeAtEnd(): Promise<void> {
    const isLast = this.steps[this.at]?.kind === "debrief";
    const isComplete = this.log?.records.some((known) => known.type === "complete");
    if (isLast && !isComplete) await this.store({ type: "complete" });
  }

  /** Deletes all data and ends the participation. */
  private async leave(): Promise<void> {
    this.dialog?.close();
    // The episode stops first, so that it cannot append to a deleted log.
    this.playing = "before";
    this.game = undefined;
    const { entering, upload } = this;
    const log = this.log ?? entering?.log;
    this.log = undefined;
    this.entering = undefined;
    this.hasLeft = true;
    this.waits = "deletion";
    entering?.participant.abort();
    upload?.stop();
    const identity = await log?.readIdentity();
    this.focusHeading();
    if (log && identity) await this.deleteEverywhere(log, identity);
    else if (log) await this.deleteLog(log);
    this.waits = undefined;
  }

  /** Deletes a log, and shows whether the deletion waits for another tab. */
  private async deleteLog(log: StudyLog): Promise<void> {
    await log.delete(() => (this.isDeletionBlocked = true));
    this.isDeletionBlocked = false;
  }

  /** Deletes the data in this browser, then those on the server. A reload goes on with what is left. */
  private async deleteEverywhere(log: StudyLog, identity: Identity): Promise<void> {
    await log.setIdentity({ ...identity, isLeaving: true });
    await log.clear();
    await new Participant(identity).delete();
    await this.deleteLog(log);
  }

  /** Removes the copy in this browser after the end, for example before the next participant. */
  private async removeCopy(): Promise<void> {
    const { log } = this;
    this.upload?.stop();
    if (log) await this.deleteLog(log);
    this.log = undefined;
    this.waits = "removed";
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
    const isSimulatedByServer = this.isSimulatedByServer();
    if (!isSimulatedByServer) this.module ??= await moduleBytes();
    const [, condition, episode, helper] = step.trial;
    const { seat, input } = content.conditions[condition]!;
    const isOpen = openTrial(log.records) === step.number;
    if (!isOpen) await this.store({ type: "trial", trial: step.number });
    this.game = {
      module: this.module ?? new ArrayBuffer(0),
      episode: new TextEncoder().encode(content.episodes[episode ?? -1] ?? ""),
      config: { seed: content.seed, seat: seat === "partner" ? 0 : 1, level: input, helper: helper ?? "none" },
      isLive: content.play.world === "goes_on",
      speed: content.play.speed,
      isStudy: true,
      startSimulator: isSimulatedByServer ? (receive) => this.startSimulator(step.number, receive) : undefined,
    };
    this.playing = "running";
    // The pressed button is gone.
    void this.updateComplete.then(() => this.player?.focus({ preventScroll: true }));
  }

  /** Starts the simulator on the server. It waits until the server knows that the episode has begun. */
  private startSimulator(trial: number, receive: (response: Response) => void): Simulator {
    const changed = (isLost: boolean): void => {
      this.isConnectionLost = isLost;
    };
    const simulator = new ServerSimulator(this.participant!, trial, receive, changed);
    const sent = this.upload!.sent();
    return {
      post: (request) => void sent.then(() => simulator.post(request)),
      close: () => simulator.close(),
    };
  }

  private endTrial(trial: number, outcome: TrialOutcome): void {
    // A game that is stopped may end by itself at the same time.
    if (this.endedTrial === trial) return;
    this.endedTrial = trial;
    void this.store({ type: "trial_end", trial, outcome }).then(() => {
      this.playing = "over";
      void this.updateComplete.then(() => this.querySelector<HTMLElement>("#continue")?.focus());
    });
  }

  /** Saves the data as a file. If the server simulates, it has the traces, so the file comes from the server. */
  private async download(): Promise<void> {
    // The server refuses the file before it has the last record.
    const file = this.isSimulatedByServer()
      ? await this.participant?.data().catch(() => undefined)
      : this.log?.toText();
    this.hasDownloadFailed = file === undefined;
    if (file === undefined) return;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([file], { type: "application/jsonl" }));
    link.download = `${this.code()}.jsonl`;
    link.click();
    // Some browsers read the file after the click.
    setTimeout(() => URL.revokeObjectURL(link.href), KEPT_DOWNLOAD_MS);
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
        <p class="small" role="status">${this.delay()}</p>
        ${this.current()}
      </section>
      ${this.question()}
    </div>`;
  }

  /** Describes delays by another tab or a lost connection, and the options of the participant. */
  private delay(): string {
    if (this.isDeletionBlocked) {
      return "This study is open in another tab, so the data in this browser are not deleted yet. Close that tab.";
    }
    const isPlaying = this.playing === "running" && this.isSimulatedByServer();
    if (this.hasLeft || !(this.upload?.state === "waiting" || (isPlaying && this.isConnectionLost))) return "";
    return isPlaying
      ? "There is no connection to the server. The episode goes on when it is back."
      : "There is no connection to the server. Go on: your data are kept in this browser and sent later.";
  }

  private bar(): TemplateResult {
    // Without the copy in this browser, the page cannot delete the data on the server.
    const isLeaveDisabled = this.hasLeft || this.waits === "removed";
    return html`<div class="bar" role="group" aria-label="Study">
      ${this.scanner.controls("One switch: offers one choice after the other")}
      <button type="button" id="leave" ?disabled=${isLeaveDisabled} @click=${() => this.dialog?.showModal()}>
        Stop and delete
      </button>
    </div>`;
  }

  private question(): TemplateResult {
    return html`<dialog aria-labelledby="leave-title">
      <h2 id="leave-title">Stop and delete?</h2>
      <p>The study ends, and all your data ${this.places()} are deleted.</p>
      <p>
        <button type="button" @click=${() => void this.leave()}>Delete and stop</button>
        <button type="button" @click=${() => this.dialog?.close()}>Go on with the study</button>
      </p>
    </dialog>`;
  }

  private places(): string {
    return this.content?.server ? "in this browser and on the server" : "in this browser";
  }

  private current(): TemplateResult {
    const { content } = this;
    if (!content || this.isLoading) return this.problem ? html`` : html`<p role="status">Loading ...</p>`;
    if (this.hasLeft) {
      return html`${this.heading("You have stopped")}
        <p role="status">${this.deletion(content)}</p>`;
    }
    switch (this.waits) {
      case "entry":
        return html`${this.heading(content.title)}
          <p role="status">The page asks the server for a place until it answers ...</p>`;
      case "full":
        return html`${this.heading("All places are taken")}
          <p>Thank you. Nothing is stored. You may close this page.</p>`;
      case "removed":
        return html`${this.heading("The end")}
          <p>The copy in this browser is removed. The next participant can load this page again.</p>`;
    }
    if (this.slotNumber === undefined && !content.server) return this.slotQuestion(content);
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

  /** Describes the progress of the deletion of all data. */
  private deletion({ server }: StudyContent): string {
    if (this.waits !== "deletion") return `All your data ${this.places()} are deleted. You may close this page.`;
    if (!server || this.isDeletionBlocked) return "Your data are being deleted. Keep this page open.";
    return "The server has not confirmed the deletion yet. Keep this page open, or open it again later.";
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
        <button type="button" @click=${() => void this.once(() => this.agree())}>I agree and take part</button>
        <button type="button" @click=${() => void this.leave()}>I do not take part</button>
      </p>`;
  }

  private instructions({ instructions }: StudyContent): TemplateResult {
    return html`${this.heading("Instructions")} ${paragraphs(instructions)}
      <p>Your code is <b class="code">${this.code()}</b>. Keep it: with it, the researchers can delete your data later.</p>
      <p><button type="button" @click=${() => void this.once(() => this.advance({ type: "instructed" }))}>Continue</button></p>`;
  }

  private trial(step: Extract<Step, { kind: "trial" }>): TemplateResult {
    const trials = this.steps.filter((other) => other.kind === "trial");
    const isPractice = step.trial[0] === 0;
    const isOpen = openTrial(this.log?.records ?? []) === step.number;
    const notRepeated = this.isSimulatedByServer() ? "" : "An episode that was interrupted is not repeated.";
    const resumed = isOpen ? "The episode goes on where you were." : notRepeated;
    const title = `Episode ${step.number + 1} of ${trials.length}${isPractice ? ", practice" : ""}`;
    if (this.playing === "before") {
      return html`${this.heading(title)}
        ${this.isResumed ? html`<p>The study goes on here. ${resumed}</p>` : nothing}
        <p>${isPractice ? "This episode is for practice." : "This episode counts."}</p>
        <p>
          <button type="button" @click=${() => void this.once(() => this.startTrial(step))}>
            ${isOpen ? "Go on with the episode" : "Start the episode"}
          </button>
        </p>`;
    }
    return html`${this.heading(title)}
      <chaic-play
        .workerSource=${this.isSimulatedByServer() ? "" : workerSource()}
        .game=${this.game}
        @recorded=${(event: CustomEvent<string>) =>
          void this.store({ type: "trace", trial: step.number, text: event.detail })}
        @over=${(event: CustomEvent<TrialOutcome>) => this.endTrial(step.number, event.detail)}
      ></chaic-play>
      ${this.playing === "over"
        ? html`<p>The episode is over. <button type="button" id="continue" @click=${() => void this.once(() => this.advance())}>Continue</button></p>`
        : nothing}`;
  }

  private questions(content: StudyContent, step: Extract<Step, { kind: "form" }>): TemplateResult {
    const form = content.forms[step.name]!;
    const answered = (event: CustomEvent<Ratings>): void => {
      const { position, name } = step;
      void this.once(() => this.advance({ type: "answers", position, form: name, ratings: event.detail }));
    };
    // The next form starts without answers.
    return html`${this.heading(form.title)}
      ${keyed(
        `${step.position} ${step.name}`,
        html`<chaic-form .form=${form} .other=${step.other} @answered=${answered}></chaic-form>`,
      )}`;
  }

  private debrief(content: StudyContent): TemplateResult {
    return html`${this.heading("The end")} ${paragraphs(content.debrief)}
      <p>Completion code: <b class="code">${content.completion_code}</b></p>
      <p>Your code: <b class="code">${this.code()}</b>. With it, the researchers can delete your data.</p>
      <p>
        <button type="button" @click=${() => void this.download()}>Download your data</button>
      </p>
      <p role="status">${this.hasDownloadFailed ? "The server does not send the file now. Try again later." : ""}</p>
      <p class="small">The file has your answers and your decisions. It has no name, no address and no times of day.
        "Stop and delete" removes ${content.server ? "all your data, also on the server" : "the copy in this browser"}.</p>
      ${this.upload ? this.uploaded(this.upload) : nothing}`;
  }

  /** Shows whether the server has all data. */
  private uploaded({ state }: Upload): TemplateResult {
    if (state !== "saved") {
      return html`<p role="status">The server does not have all your data yet. Keep this page open, or open it again
        later.
        ${this.isSimulatedByServer()
          ? nothing
          : "If that does not help, download your data and send them to the researchers."}</p>`;
    }
    return html`<p role="status">The server has all your data. You may close this page.</p>
      <p><button type="button" @click=${() => void this.removeCopy()}>Remove the copy in this browser</button></p>`;
  }
}

customElements.define("chaic-study", ChaicStudy);
