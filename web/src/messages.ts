// Messages between a page and its worker, and the values of the module (crates/app/chaic-web).

/** Kind of activity. */
export type ActivityKind = "walk" | "interact" | "wait";

/** Time that an agent spends on one kind of activity; frames. */
export interface Activity {
  agent: number;
  kind: ActivityKind;
  start: number;
  end: number;
  failed: boolean;
}

/** Event in words. */
export interface StoryLine {
  frame: number;
  text: string;
}

/** Delivery that counts toward the goal. */
export interface Delivery {
  frame: number;
  by: number;
  done: number;
}

/** Agent of an episode. */
export interface AgentInfo {
  id: number;
  name: string;
  person: string;
  reach_m: [number, number];
  strength_kg: number;
}

/** Facts about a replay that do not change. */
export interface ReplayInfo {
  task: string;
  episode: string;
  helper: string;
  seed: number;
  chaic: string;
  agents: AgentInfo[];
  goal: string[];
  last_frame: number;
  length: number;
  frames_per_second: number;
  total: number;
  n_verified: number;
  n_decisions: number;
  problem: string | null;
  timeline: { activities: Activity[]; story: StoryLine[]; deliveries: Delivery[] };
}

/** Belief about the partner; probabilities per mille. */
export interface Belief {
  goals: [string, number][];
  people: [string, number][];
  evidence?: string[];
}

/** State of one frame. */
export interface FrameState {
  frame: number;
  captions: { agent: string; action: string; plan: string; last_observed: string | null }[];
  done: number;
  n_verified: number;
  belief: Belief | null;
}

/** Image for a canvas. */
export interface Picture {
  width: number;
  height: number;
  rgba: Uint8ClampedArray<ArrayBuffer>;
}

/** Message to the worker. */
export type Request =
  | { type: "open"; module: ArrayBuffer; trace: Uint8Array; episode: Uint8Array }
  | { type: "frame"; frame: number; agents: number[]; viewPx: number; mapPx: number };

/** Message of the worker. */
export type Response =
  | { type: "opened"; info: ReplayInfo }
  | { type: "frame"; state: FrameState; views: Picture[]; map: Picture }
  | { type: "error"; message: string };
