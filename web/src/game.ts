// Playing in a page: starts a game, and offers its trace and replay at the end.

import type { Branch, LiveConfig } from "./messages.js";
import "./play.js";
import type { ChaicPlay, GameResult } from "./play.js";

/** Speed of the world, and whether it waits for the person. */
export interface Pace {
  isLive: boolean;
  speed: number;
}

/** Returns a line that offers a trace for download, and its replay. */
export function traceOffer(trace: string, onReplay: () => void): Element {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([trace], { type: "application/jsonl" }));
  link.download = "trace.jsonl";
  link.textContent = "Download the trace";
  const watch = document.createElement("button");
  watch.type = "button";
  watch.textContent = "Watch the replay";
  watch.addEventListener("click", onReplay);
  const line = document.createElement("p");
  line.append(link, " (chaic verify trace.jsonl checks it) ", watch);
  return line;
}

/** Plays an episode in an element of the page; `onReplay` receives the trace if the person wants to watch it. */
export async function startGame(
  place: Element,
  game: { module: ArrayBuffer; workerSource: string; episode: Uint8Array; config: LiveConfig; pace: Pace; branch?: Branch },
  onReplay: (result: GameResult) => void,
): Promise<void> {
  const { workerSource, pace, ...rest } = game;
  const element = document.createElement("chaic-play") as ChaicPlay;
  Object.assign(element, { workerSource, game: { ...rest, ...pace } });
  element.addEventListener("finished", (event) => {
    const { detail: result } = event as CustomEvent<GameResult>;
    place.append(traceOffer(result.trace, () => onReplay(result)));
  });
  place.replaceChildren(element);
  // The game takes the focus, so that the start button does not receive its keys.
  element.focus({ preventScroll: true });
}
