// Page of `chaic view`: a choice of replays, and the selected one. All data are in the page.

import "./replay.js";
import type { ChaicReplay } from "./replay.js";

/** Content of an embedded replay. */
interface Embedded {
  trace: string;
  episode: string;
}

const MODULE_ID = "chaic-module";
const WORKER_ID = "chaic-worker";

/** Decodes the base64 text of an element and decompresses it (raw deflate). */
async function embedded(element: Element): Promise<ArrayBuffer> {
  const bytes = Uint8Array.from(atob(element.textContent!.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Response(stream).arrayBuffer();
}

/** Position in the page's address: `#2@310` is frame 310 of the third replay. */
function address(): { replay: number; frame: number } {
  const [, replay, frame] = /^#(\d+)@(\d+)$/.exec(location.hash) ?? [];
  return { replay: Number(replay ?? 0), frame: Number(frame ?? 0) };
}

async function main(): Promise<void> {
  const replays = [...document.querySelectorAll("script.chaic-replay")];
  const player = document.querySelector("chaic-replay") as ChaicReplay;
  const select = document.querySelector("select") as HTMLSelectElement;
  const module = await embedded(document.getElementById(MODULE_ID)!);
  player.workerSource = document.getElementById(WORKER_ID)!.textContent!;
  const show = async (replay: number, frame: number): Promise<void> => {
    const element = replays[replay];
    if (!element) return;
    select.value = String(replay);
    const content: Embedded = JSON.parse(new TextDecoder().decode(await embedded(element)));
    const encoder = new TextEncoder();
    const [trace, episode] = [content.trace, content.episode].map((text) => encoder.encode(text));
    player.start = frame;
    player.source = { module, trace: trace!, episode: episode! };
  };
  let pending = 0;
  player.addEventListener("moved", (event) => {
    // Browsers refuse frequent changes of the address.
    clearTimeout(pending);
    const frame = (event as CustomEvent<number>).detail;
    const hash = `#${select.value}@${frame}`;
    pending = window.setTimeout(() => history.replaceState(null, "", hash), 300);
  });
  select.addEventListener("change", () => void show(Number(select.value), 0));
  addEventListener("hashchange", () => {
    const { replay, frame } = address();
    if (String(replay) === select.value) player.seek(frame);
    else void show(replay, frame);
  });
  const { replay, frame } = address();
  await show(replay, frame);
}

void main().catch((problem: unknown) => {
  const status = document.querySelector("[data-status]");
  if (status) status.textContent = `Cannot show the replays: ${String(problem)}`;
});
