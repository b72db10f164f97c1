// Worker that re-simulates and draws one replay, so that the page stays responsive.

import { initSync, Player } from "../pkg/chaic_web.js";
import type { Picture, Request, Response } from "./messages.js";

let player: Player | undefined;

function send(response: Response, transfer: ArrayBuffer[] = []): void {
  postMessage(response, { transfer });
}

function taken(picture: { width: number; height: number; rgba(): Uint8Array; free(): void }): Picture {
  const { width, height } = picture;
  const rgba = new Uint8ClampedArray(picture.rgba() as Uint8Array<ArrayBuffer>);
  picture.free();
  return { width, height, rgba };
}

function answer(request: Request): void {
  if (request.type === "open") {
    initSync({ module: request.module });
    player?.free();
    player = new Player(request.trace, request.episode);
    send({ type: "opened", info: JSON.parse(player.info()) });
    return;
  }
  if (!player) return;
  const state = JSON.parse(player.seek(request.frame));
  const views = request.agents.map((agent) => taken(player!.view(agent, request.viewPx)));
  const map = taken(player.map(request.mapPx));
  send({ type: "frame", state, views, map }, [...views, map].map((picture) => picture.rgba.buffer));
}

onmessage = (event: MessageEvent<Request>) => {
  try {
    answer(event.data);
  } catch (problem) {
    send({ type: "error", message: problem instanceof Error ? problem.message : String(problem) });
  }
};
