// Differences between two replays of one episode.

import type { DecisionLine, Delivery, ReplayInfo } from "./messages.js";

/** First decision that differs between two runs; one of them is missing if a run has no more decisions. */
export interface FirstDifference {
  frame: number;
  decisions: [DecisionLine | undefined, DecisionLine | undefined];
}

/** Returns the first differing decision of two runs; undefined if their decisions are equal. */
export function firstDifference(a: ReplayInfo, b: ReplayInfo): FirstDifference | undefined {
  // Compares only agents that both runs have, because the presence of a helper is no decision.
  const common = (info: ReplayInfo, other: ReplayInfo): DecisionLine[] =>
    info.decisions.filter((line) => other.agents.some((agent) => agent.id === line.agent));
  const [first, second] = [common(a, b), common(b, a)];
  const n = Math.max(first.length, second.length);
  for (let k = 0; k < n; k++) {
    const [x, y] = [first[k], second[k]];
    if (x && y && x.frame === y.frame && x.agent === y.agent && x.text === y.text) continue;
    const frame = Math.min(x?.frame ?? Infinity, y?.frame ?? Infinity);
    return { frame, decisions: [x, y] };
  }
  return undefined;
}

/** Returns the delivered value at a frame. */
export function doneAt(deliveries: Delivery[], frame: number): number {
  return deliveries.filter((delivery) => delivery.frame <= frame).at(-1)?.done ?? 0;
}

/** Returns the points of a step function, as coordinates of an SVG path: x is the frame, y the delivered fraction. */
export function progressPath(info: ReplayInfo): string {
  const steps = info.timeline.deliveries.map(({ frame, done }) => `H${frame}V${(1 - done / info.total).toFixed(4)}`);
  return `M0 1${steps.join("")}H${info.last_frame}`;
}
