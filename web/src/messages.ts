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

/** Decision in words. */
export interface DecisionLine {
  frame: number;
  agent: number;
  text: string;
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
  decisions: DecisionLine[];
  trail_interval: number;
  /** Positions of each agent, in widths of the map from its left and upper edge. */
  trails: [number, number][][];
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

/** Level of a person's decisions. */
export type InputLevel = "plans" | "steps";

/** What is played, and by whom. */
export interface LiveConfig {
  seed: number;
  /** Agent that the person controls: 0 is the partner, 1 the helper. */
  seat: number;
  level: InputLevel;
  /** Helper if the person is the partner. */
  helper: string;
}

/** Facts about a played episode that do not change. */
export interface LiveInfo {
  task: string;
  episode: string;
  /** Empty for a person who must find out. */
  goal: string[];
  /** Kind of person of the person's body. */
  person: string;
  reach_m: [number, number];
  strength_kg: number;
  frames_per_second: number;
}

/** State of a played episode. */
export interface LiveState {
  frame: number;
  horizon: number;
  status: "running" | "waiting" | "ended";
  plans: string[];
  hands: [string | null, string | null];
  failure: string | null;
  caption: { action: string; plan: string };
  /** Achieved and total value of the goal; null for a person who helps, until the end. */
  progress: [number, number] | null;
  events: StoryLine[];
}

/** Action of a person, as in a trace. */
export type Action = string | Record<string, unknown>;

/** Message to the worker. */
export type Request =
  | { type: "open"; module: ArrayBuffer; trace: Uint8Array; episode: Uint8Array }
  | { type: "frame"; frame: number; agents: number[]; viewPx: number; mapPx: number }
  | { type: "play"; module: ArrayBuffer; episode: Uint8Array; config: LiveConfig; branch?: Branch }
  | { type: "advance"; frames: number; viewPx: number; input?: { plan: number } | { action: Action } }
  | { type: "trace" }
  | { type: "reference"; helper: string };

/** Trace and frame from which a person goes on. */
export interface Branch {
  trace: Uint8Array;
  frame: number;
}

/** Message of the worker. */
export type Response =
  | { type: "opened"; info: ReplayInfo }
  | { type: "frame"; state: FrameState; views: Picture[]; map: Picture | null }
  | { type: "playing"; info: LiveInfo }
  | { type: "live"; state: LiveState; view: Picture }
  | { type: "trace"; trace: string }
  | { type: "reference"; helper: string; rate: number }
  | { type: "error"; message: string };
