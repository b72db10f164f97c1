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

/** Facts about a replay, as far as it is re-simulated. */
export interface ReplayInfo {
  task: string;
  episode: string;
  helper: string;
  seed: number;
  chaic: string;
  /** Frame from which this trace continues another trace. */
  branch_at: number | null;
  /** Helpers that can take over. */
  successors: string[];
  agents: AgentInfo[];
  goal: string[];
  /** True if the re-simulation has ended. */
  is_complete: boolean;
  last_frame: number;
  length: number;
  frames_per_second: number;
  total: number;
  /** Unit of the value of the goal; empty for a number of objects. */
  unit: string;
  n_verified: number;
  n_decisions: number;
  problem: string | null;
  timeline: { activities: Activity[]; story: StoryLine[]; deliveries: Delivery[] };
  decisions: DecisionLine[];
  /** Height of the map without its legend, in widths of the map. */
  map_height: number;
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

/** Part of an exchange with a language model. */
export interface Passage {
  heading: string;
  text: string;
}

/** Agent whose plans a language model chose. */
export interface LanguageAgent {
  agent: string;
  model: string;
  decisions: { frame: number; text: string; passages: Passage[] }[];
  /** Number of decisions whose passages are not in the page. */
  n_left_out: number;
  /** Reason why the record cannot be read. */
  problem: string | null;
}

/** State of one frame. */
export interface FrameState {
  frame: number;
  captions: { agent: string; action: string; plan: string; last_observed: string | null }[];
  done: number;
  n_verified: number;
  belief: Belief | null;
  /** Objects that each agent detects in its image; positions in widths of the view from its left and upper edge. */
  detected: { label: string; at: [number, number] }[][];
}

/** Agreement of an agent that runs again with the replay. */
export interface RerunInfo {
  agent: number;
  /** False if the agent cannot run in a page. */
  is_available: boolean;
  n_equal: number;
  /** Frame of the first decision that differs. */
  differs_at: number | null;
}

/** State of the agents that run again beside a replay. */
export interface RerunState {
  /** Frame that these agents have reached. */
  frame: number;
  is_complete: boolean;
  agents: RerunInfo[];
}

/** Position on the map, in widths of the map from its left and upper edge. */
export type Place = [number, number];

/** Memory of an agent at a frame. */
export interface Memory {
  agent: number;
  /** Frame of the decision at which the memory was stored. */
  frame: number;
  seen_m2: number;
  /** Position of the first cell. */
  map_at: Place;
  /** Side of a cell, in widths of the map. */
  cell: number;
  n_columns: number;
  /** Probability that the goal wants an object in per mille, for agents that infer the goal. */
  objects: { name: string; at: Place; last_seen: number; wanted: number | null }[];
  /** Name, last known position and frame of other people. */
  people: [string, Place, number][];
  path: Place[];
  path_m: number;
  plan: string;
  is_belief_equal: boolean | null;
  /** Cells row by row: 0 is unknown, 1 free, 2 occupied. */
  cells: Uint8Array;
}

/** Movable object of the goal, container or obstacle. */
export interface TaskObject {
  name: string;
  at: Place;
  /** Limits of the partner that it exceeds. */
  limits: ("too_high" | "too_low" | "too_heavy")[];
  top_m: number;
  mass_kg: number;
}

/** Data of the map's layers, from the worker. */
export interface LayerData {
  memories: Memory[];
  /** Objects of the task; empty if the limits of the partner are not shown. */
  objects: TaskObject[];
}

/** Image for a canvas. */
export interface Picture {
  width: number;
  height: number;
  rgba: Uint8ClampedArray<ArrayBuffer>;
}

/** Line of text on a map, in pixels; colors are red, green and blue. */
export interface MapLabel {
  text: string;
  /** Anchor on the baseline. */
  at: [number, number];
  font_px: number;
  width_px: number;
  align: "left" | "center" | "right";
  color: [number, number, number];
  border: [number, number, number] | null;
}

/** Map without its text, and the text. */
export interface MapPicture extends Picture {
  labels: MapLabel[];
}

/** Level of a person's decisions. */
export type InputLevel = "plans" | "steps";

/** Configuration of a played episode. */
export interface LiveConfig {
  seed: number;
  /** Agent that the person controls: 0 is the partner, 1 the helper. */
  seat: number;
  level: InputLevel;
  /** Helper if the person is the partner. */
  helper: string;
  /** True if the world goes on while the person thinks. */
  is_live?: boolean;
}

/** Facts about a played episode that do not change. */
export interface LiveInfo {
  task: string;
  episode: string;
  /** Empty for a person who must find out. */
  goal: string[];
  /** Unit of the value of the goal; empty for a number of objects. */
  unit: string;
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
  /** True if the person's last decision could not be taken. */
  is_refused: boolean;
  caption: { action: string; plan: string };
  /** Achieved and total value of the goal; null for a person who helps, until the end. */
  progress: [number, number] | null;
  events: StoryLine[];
}

/** Action of a person, as in a trace. */
export type Action = string | Record<string, unknown>;

/** Pictures and layers of a frame. */
export interface Wanted {
  /** Agents whose views are drawn. */
  agents: number[];
  /** Side of a view, pixels. */
  viewPx: number;
  /** Width of the map, pixels; 0 for none. */
  mapPx: number;
  /** Agents whose memories are shown. */
  memories: number[];
  /** True if the limits of the partner are shown. */
  withLimits: boolean;
}

/** Message to the worker. */
export type Request =
  | { type: "open"; module: ArrayBuffer; trace: Uint8Array; episode: Uint8Array }
  | ({ type: "frame"; frame: number } & Wanted)
  | { type: "rerun" }
  | { type: "play"; module: ArrayBuffer; episode: Uint8Array; config: LiveConfig; branch?: Branch }
  | { type: "advance"; frames: number; viewPx: number; input?: { plan: string } | { action: Action } }
  /** `isPartial` requests only the lines that no earlier request has returned. */
  | { type: "trace"; isPartial: boolean }
  | { type: "reference"; helper: string }
  | ({ type: "continue"; module: ArrayBuffer; episode: Uint8Array; helper: string } & Branch);

/** Trace and frame from which a person or another helper goes on. */
export interface Branch {
  trace: Uint8Array;
  frame: number;
}

/** Message of the worker. */
export type Response =
  | { type: "opened"; info: ReplayInfo }
  | { type: "verified"; info: ReplayInfo }
  | { type: "frame"; state: FrameState; views: Picture[]; map: MapPicture | null; layers: LayerData }
  | { type: "rerun"; state: RerunState }
  | { type: "playing"; info: LiveInfo }
  | { type: "live"; state: LiveState; view: Picture }
  | { type: "trace"; trace: string }
  | { type: "reference"; helper: string; rate: number }
  /** The episode has ended before this page was loaded; only from a server. */
  | { type: "over" }
  | { type: "error"; message: string };

/** Simulator of an episode: a worker or a server. Responses arrive in the order of the requests. */
export interface Simulator {
  post(request: Request): void;
  close(): void;
}
