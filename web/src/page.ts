// Page of `chaic view` and of the report of a run: sortable tables, a choice of replays, and the selected one or two. All data are in the
// page.

import "./compare.js";
import type { ChaicCompare } from "./compare.js";
import { embedded, moduleBytes, workerSource } from "./embedded.js";
import { startGame, traceOffer, type Pace } from "./game.js";
import type { LanguageAgent, LiveConfig, Request } from "./messages.js";
import type { GameResult } from "./play.js";
import type { Source } from "./player.js";
import "./replay.js";
import type { ChaicReplay } from "./replay.js";
import { makeSortable } from "./sortable.js";
import { ask } from "./workers.js";

/** Content of an embedded replay. */
interface Embedded {
  trace: string;
  episode: string;
  language: LanguageAgent[];
}

/** Content that the page shows: a replay at a frame, possibly beside another replay. */
interface Shown {
  replay: number;
  other?: number;
  frame: number;
}

/** Parses the page's address: `#2@310` is frame 310 of the third replay, `#2+0@310` the same frame beside the first replay. */
function address(): Shown {
  const [, replay, other, frame] = /^#(\d+)(?:\+(\d+))?@(\d+)$/.exec(location.hash) ?? [];
  return {
    replay: Number(replay ?? 0),
    other: other === undefined ? undefined : Number(other),
    frame: Number(frame ?? 0),
  };
}

/** Changes the fragment of the page's address. */
function setFragment(fragment: string): void {
  // Pages inside a notebook have no address.
  if (location.protocol !== "about:") history.replaceState(null, "", `#${fragment}`);
}

const encoder = new TextEncoder();

/** Replays of a page and the element that shows them. */
class Replays {
  private shown?: Shown;
  private element?: ChaicReplay | ChaicCompare;
  private pending = 0;

  constructor(
    private readonly contents: Element[],
    private readonly choice: HTMLSelectElement,
    private readonly other: HTMLSelectElement,
    private readonly player: Element,
  ) {
    const choose = (frame: number, other?: number): void => {
      void this.show({ replay: Number(choice.value), other, frame });
    };
    choice.addEventListener("change", () => choose(0));
    other.addEventListener("change", () => {
      choose(this.element?.frame ?? 0, other.value === "" ? undefined : Number(other.value));
    });
    addEventListener("hashchange", () => {
      void this.show(address());
      choice.scrollIntoView();
    });
  }

  /** Shows what the address names. */
  async show(wanted: Shown): Promise<void> {
    const contents = [wanted.replay, wanted.other].filter((k) => k !== undefined).map((k) => this.contents[k]);
    if (!contents.every((content) => content !== undefined)) {
      // The page does not have the replay in the address.
      if (this.contents.length > 0) await this.show({ replay: 0, frame: 0 });
      return;
    }
    const isChosen = this.isChosen(wanted);
    this.shown = wanted;
    if (isChosen) {
      this.element?.seek(wanted.frame);
      return;
    }
    this.select(wanted);
    let sources: Source[];
    try {
      sources = await Promise.all(contents.map((content) => this.source(content)));
    } catch (problem) {
      // The previous replay would look like the chosen one.
      if (this.isChosen(wanted)) this.clear();
      throw problem;
    }
    // Another choice was made meanwhile.
    if (!this.isChosen(wanted)) return;
    tell("");
    const [first, second] = sources;
    const common = { workerSource: workerSource(), start: this.shown.frame };
    if (second) {
      const element = document.createElement("chaic-compare") as ChaicCompare;
      this.element = Object.assign(element, { sources: [first, second], ...common });
    } else {
      this.element = replayElement(first!, this.shown.frame);
    }
    this.element.addEventListener("moved", (event) => this.moved((event as CustomEvent<number>).detail));
    this.player.replaceChildren(this.element);
  }

  /** Shows an element with a replay that is not among those of the page. */
  showOther(element: ChaicReplay | ChaicCompare): void {
    this.clear();
    this.choice.selectedIndex = -1;
    this.other.replaceChildren();
    this.other.disabled = true;
    this.player.replaceChildren(element);
    // The address of the previous replay would be wrong.
    setFragment("");
  }

  /** Shows no replay. */
  private clear(): void {
    clearTimeout(this.pending);
    this.shown = undefined;
    this.element = undefined;
    this.player.replaceChildren();
  }

  private isChosen({ replay, other }: Shown): boolean {
    return this.shown?.replay === replay && this.shown.other === other;
  }

  private async source(content: Element): Promise<Source> {
    const { trace, episode, language }: Embedded = JSON.parse(new TextDecoder().decode(await embedded(content)));
    const module = await moduleBytes();
    return { module, trace: encoder.encode(trace), episode: encoder.encode(episode), language };
  }

  /** Selects a replay in the lists; the second list has the other runs of its episode and seed. */
  private select({ replay, other }: Shown): void {
    this.choice.value = String(replay);
    const options = [...this.choice.options];
    const place = options[replay]?.dataset.place;
    const rivals = options.filter((option, k) => k !== replay && option.dataset.place === place);
    this.other.replaceChildren(new Option("nothing", ""), ...rivals.map((option) => new Option(option.text, option.value)));
    this.other.value = other === undefined ? "" : String(other);
    this.other.disabled = rivals.length === 0;
  }

  private moved(frame: number): void {
    // Browsers refuse frequent changes of the address.
    clearTimeout(this.pending);
    const { replay, other } = this.shown!;
    const name = other === undefined ? replay : `${replay}+${other}`;
    this.pending = window.setTimeout(() => setFragment(`${name}@${frame}`), 300);
  }
}

let replays: Replays | undefined;
/** Ends the worker of a helper that continues a replay, when another element takes its place. */
let continuation = new AbortController();

/** Ends the worker of a helper that continues a replay; returns the abort signal for the next worker. */
function endContinuation(): AbortSignal {
  continuation.abort();
  continuation = new AbortController();
  return continuation.signal;
}

/** Creates the element of a replay, from which a person or another helper can take over. */
function replayElement(source: Source, start: number): ChaicReplay {
  const element = document.createElement("chaic-replay") as ChaicReplay;
  element.addEventListener("take-over", (event) => {
    const { frame, seat, seed } = (event as CustomEvent<{ frame: number; seat: number; seed: number }>).detail;
    const config: LiveConfig = { seed, seat, level: "plans", helper: "none" };
    void play(source.episode, config, { isLive: false, speed: 1 }, { trace: source.trace, frame });
  });
  element.addEventListener("go-on", (event) => {
    const { frame, helper } = (event as CustomEvent<{ frame: number; helper: string }>).detail;
    void goOn(source, frame, helper);
  });
  return Object.assign(element, { source, workerSource: workerSource(), start });
}

/** Lets another helper go on from a frame of a replay, and shows both runs beside each other. */
async function goOn(source: Source, frame: number, helper: string): Promise<void> {
  const place = document.getElementById("play")!;
  const shown = document.getElementById("player")!.firstElementChild;
  const status = document.createElement("p");
  status.setAttribute("role", "status");
  status.textContent = `The helper ${helper} goes on ...`;
  place.replaceChildren(status);
  const { module, trace: from, episode } = source;
  const signal = endContinuation();
  const request: Request = { type: "continue", module, trace: from, episode, frame, helper };
  const response = await ask(workerSource(), request, signal);
  // Meanwhile, a game or another helper has taken the place on the page.
  if (!response || !status.isConnected) return;
  if (response.type !== "trace") {
    status.textContent = `The helper ${helper} cannot go on: ${response.type === "error" ? response.message : response.type}`;
    return;
  }
  const { trace } = response;
  status.textContent = `The helper ${helper} went on.`;
  const branch = { ...source, trace: encoder.encode(trace), language: [] };
  place.append(traceOffer(trace, () => showElement(replayElement(branch, frame))));
  // Another replay was selected meanwhile.
  if (document.getElementById("player")!.firstElementChild !== shown) return;
  const element = document.createElement("chaic-compare") as ChaicCompare;
  showElement(Object.assign(element, { sources: [source, branch], workerSource: workerSource(), start: frame }));
}

/** Shows an element in the place of the selected replay. */
function showElement(element: ChaicReplay | ChaicCompare): void {
  if (replays) replays.showOther(element);
  else document.getElementById("player")!.replaceChildren(element);
  element.scrollIntoView();
}

/** Starts a game; its replay replaces the shown one when the person asks for it. */
async function play(
  episode: Uint8Array,
  config: LiveConfig,
  pace: Pace,
  branch?: { trace: Uint8Array; frame: number },
): Promise<void> {
  const place = document.getElementById("play")!;
  endContinuation();
  const module = await moduleBytes();
  const watch = ({ trace }: GameResult): void => {
    showElement(replayElement({ module, trace: encoder.encode(trace), episode, language: [] }, 0));
  };
  await startGame(place, { module, workerSource: workerSource(), episode, config, pace, branch }, watch);
  place.scrollIntoView();
}

/** Starts the games that the form of a page describes. */
function listen(form: HTMLFormElement): void {
  const episodes = [...document.querySelectorAll("script.chaic-episode")];
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const data = new FormData(form);
    const value = (name: string): string => String(data.get(name));
    const content = episodes[Number(value("episode"))];
    if (!content) return;
    const level = value("level") as LiveConfig["level"];
    const config = { seed: 0, seat: Number(value("seat")), level, helper: value("helper") };
    const pace = { isLive: value("pace") === "live", speed: Number(value("speed")) };
    void embedded(content).then((episode) => play(new Uint8Array(episode), config, pace));
  });
}

async function main(): Promise<void> {
  const form = document.querySelector<HTMLFormElement>("#game");
  if (form) listen(form);
  document.querySelectorAll<HTMLTableElement>("table.sortable").forEach(makeSortable);
  const contents = [...document.querySelectorAll("script.chaic-replay")];
  const choice = document.querySelector<HTMLSelectElement>("#choice");
  const other = document.querySelector<HTMLSelectElement>("#other");
  const player = document.querySelector("#player");
  if (!choice || !other || !player) return;
  replays = new Replays(contents, choice, other, player);
  await replays.show(address());
}

/** Writes the status of the page. */
function tell(text: string): void {
  const status = document.querySelector("[data-status]");
  if (status) status.textContent = text;
}

function fail(problem: unknown): void {
  const purpose = document.querySelector("#game") ? "play" : "show the replays";
  tell(`Cannot ${purpose}: ${String(problem)}`);
}

addEventListener("unhandledrejection", (event) => fail(event.reason));
void main().catch(fail);
