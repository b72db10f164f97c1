// Worker that re-simulates, plays and draws, so that the page stays responsive.

import { initSync, Live, Player, reference_rate } from "../pkg/chaic_web.js";
import type { Picture, Request, Response } from "./messages.js";

let player: Player | undefined;
let live: Live | undefined;
let episode: Uint8Array | undefined;
let seed = 0;

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
  switch (request.type) {
    case "open":
      initSync({ module: request.module });
      player = new Player(request.trace, request.episode);
      send({ type: "opened", info: JSON.parse(player.info()) });
      break;
    case "frame":
      drawFrame(request);
      break;
    case "play":
      play(request);
      break;
    case "advance":
      advance(request);
      break;
    case "trace":
      send({ type: "trace", trace: live?.trace() ?? "" });
      break;
    case "reference":
      if (!episode) break;
      send({ type: "reference", helper: request.helper, rate: reference_rate(episode, request.helper, seed) });
      break;
  }
}

function drawFrame(request: Extract<Request, { type: "frame" }>): void {
  if (!player) return;
  const state = JSON.parse(player.seek(request.frame));
  const views = request.agents.map((agent) => taken(player!.view(agent, request.viewPx)));
  const map = request.mapPx > 0 ? taken(player.map(request.mapPx)) : null;
  const pictures = map ? [...views, map] : views;
  send({ type: "frame", state, views, map }, pictures.map((picture) => picture.rgba.buffer));
}

function play(request: Extract<Request, { type: "play" }>): void {
  initSync({ module: request.module });
  ({ episode } = request);
  ({ seed } = request.config);
  const config = JSON.stringify(request.config);
  const { branch } = request;
  live = branch
    ? Live.take_over(branch.trace, request.episode, branch.frame, config)
    : new Live(request.episode, config);
  send({ type: "playing", info: JSON.parse(live.info()) });
}

function advance({ frames, viewPx, input }: Extract<Request, { type: "advance" }>): void {
  if (!live) return;
  if (input && "plan" in input) live.choose_plan(input.plan);
  if (input && "action" in input) live.act(JSON.stringify(input.action));
  live.advance(frames);
  const state = JSON.parse(live.state());
  const view = taken(live.view(viewPx));
  send({ type: "live", state, view }, [view.rgba.buffer]);
}

onmessage = (event: MessageEvent<Request>) => {
  try {
    answer(event.data);
  } catch (problem) {
    send({ type: "error", message: problem instanceof Error ? problem.message : String(problem) });
  }
};
