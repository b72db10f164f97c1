// Worker that re-simulates, plays and draws, so that the page stays responsive.

import { continued_trace, initSync, Live, Player } from "../pkg/chaic_web.js";
import type {
  LayerData,
  MapLabel,
  MapPicture,
  Memory,
  Picture,
  ReplayInfo,
  Request,
  RerunState,
  Response,
  Wanted,
} from "./messages.js";

let player: Player | undefined;
let live: Live | undefined;
let episode: Uint8Array | undefined;
let isRerunning = false;
/** Number of lines of the trace that partial requests have returned. */
let nReturnedLines = 0;
/** Trap of the WebAssembly module; after it, no further tasks run. */
let trap: WebAssembly.RuntimeError | undefined;
/** Frames that are drawn once in advance, so that browsers optimize the module before a person seeks. */
let warmUpFrames: number[] = [];

/** Longest time for which the worker re-simulates before it answers requests, milliseconds. */
const SLICE_MS = 20;
/** Number of frames that are re-simulated between two checks of the time. */
const VERIFIED_FRAMES = 20;
/** Time between messages about the progress of the agents, milliseconds. */
const PROGRESS_MS = 250;

function send(response: Response, transfer: ArrayBuffer[] = []): void {
  postMessage(response, { transfer });
}

function toPicture(picture: { width: number; height: number; rgba(): Uint8Array; free(): void }): Picture {
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
      later(verify);
      break;
    case "frame":
      drawFrame(request);
      break;
    case "rerun":
      if (!isRerunning) rerun(performance.now());
      isRerunning = true;
      break;
    case "play":
      play(request);
      break;
    case "advance":
      advance(request);
      break;
    case "trace":
      send({ type: "trace", trace: request.isPartial ? newLines() : (live?.trace() ?? "") });
      break;
    case "continue":
      initSync({ module: request.module });
      send({ type: "trace", trace: continued_trace(request.trace, request.episode, request.frame, request.helper) });
      break;
    case "reference":
      if (!live || !episode) break;
      send({ type: "reference", helper: request.helper, rate: live.reference_rate(episode, request.helper) });
      break;
  }
}

/** Re-simulates the replay in slices, so that its first frame is drawn meanwhile. */
function verify(): void {
  if (!player) return;
  const start = performance.now();
  while (!player.verify(VERIFIED_FRAMES)) {
    if (performance.now() - start < SLICE_MS) continue;
    later(verify);
    return;
  }
  const info: ReplayInfo = JSON.parse(player.info());
  warmUpFrames = [0.25, 0.5, 0.75].map((part) => Math.floor(part * info.last_frame));
  send({ type: "verified", info });
}

/** Draws the next warm-up frame, unless a request comes first. */
function warmUp(wanted: Wanted): void {
  const frame = warmUpFrames.pop();
  if (!player || frame === undefined) return;
  player.seek(frame);
  for (const agent of wanted.agents) player.view(agent, wanted.viewPx).free();
  if (wanted.mapPx > 0) player.map(wanted.mapPx).free();
  later(() => warmUp(wanted));
}

function drawnMap(from: Player, widthPx: number): MapPicture {
  const picture = from.map(widthPx);
  const labels: MapLabel[] = JSON.parse(picture.labels());
  return { ...toPicture(picture), labels };
}

function drawFrame(request: Extract<Request, { type: "frame" }>): void {
  if (!player) return;
  const state = JSON.parse(player.seek(request.frame));
  const views = request.agents.map((agent) => toPicture(player!.view(agent, request.viewPx)));
  const map = request.mapPx > 0 ? drawnMap(player, request.mapPx) : null;
  const pictures = map ? [...views, map] : views;
  const layers = layerData(player, request.memories, request.withLimits);
  send({ type: "frame", state, views, map, layers }, pictures.map((picture) => picture.rgba.buffer));
  if (warmUpFrames.length > 0) later(() => warmUp(request));
}

function layerData(from: Player, agents: number[], withLimits: boolean): LayerData {
  const memories = agents.flatMap((agent) => {
    const memory: Memory | null = JSON.parse(from.memory(agent));
    return memory ? [{ ...memory, cells: from.explored(agent) }] : [];
  });
  return { memories, objects: withLimits ? JSON.parse(from.task_objects()) : [] };
}

/** Runs the agents again in slices, so that frames are drawn meanwhile. */
function rerun(lastMessage: number): void {
  if (!player) return;
  const start = performance.now();
  let state: RerunState;
  do state = JSON.parse(player.rerun_agents());
  while (!state.is_complete && performance.now() - start < SLICE_MS);
  const isDue = performance.now() - lastMessage > PROGRESS_MS || state.is_complete;
  if (isDue) send({ type: "rerun", state });
  if (!state.is_complete) later(() => rerun(isDue ? performance.now() : lastMessage));
}

function play(request: Extract<Request, { type: "play" }>): void {
  initSync({ module: request.module });
  ({ episode } = request);
  const config = JSON.stringify(request.config);
  const { branch } = request;
  live = branch
    ? Live.take_over(branch.trace, request.episode, branch.frame, config)
    : new Live(request.episode, config);
  send({ type: "playing", info: JSON.parse(live.info()) });
}

/** Returns the lines of the trace since the last call. */
function newLines(): string {
  if (!live) return "";
  const lines = live.trace_after(nReturnedLines);
  nReturnedLines = live.n_lines();
  return lines;
}

function advance({ frames, viewPx, input }: Extract<Request, { type: "advance" }>): void {
  if (!live) return;
  if (input && "plan" in input) live.choose_plan(input.plan);
  if (input && "action" in input) live.act(JSON.stringify(input.action));
  live.advance(frames);
  const state = JSON.parse(live.state());
  const view = toPicture(live.view(viewPx));
  send({ type: "live", state, view }, [view.rgba.buffer]);
}

/** Describes a problem; a trap of the module is a bug. */
function described(problem: unknown): string {
  if (problem instanceof WebAssembly.RuntimeError) {
    const advice = "This is a bug in chaic: please report it. Load this page again to go on";
    return `the simulator has stopped (${problem.message}). ${advice}`;
  }
  return problem instanceof Error ? problem.message : String(problem);
}

/** Runs a task and reports its problem. */
function run(task: () => void): void {
  try {
    // The state of the module is undefined after a trap.
    if (trap) throw trap;
    task();
  } catch (problem) {
    if (problem instanceof WebAssembly.RuntimeError) trap = problem;
    send({ type: "error", message: described(problem) });
  }
}

/** Runs a task after the waiting requests. */
function later(task: () => void): void {
  setTimeout(() => run(task));
}

onmessage = (event: MessageEvent<Request>) => run(() => answer(event.data));
