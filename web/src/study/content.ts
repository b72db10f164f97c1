// Content of a study's page (crates/eval/chaic-study/src/content.rs), its records and its steps.

import type { InputLevel } from "../messages.js";

/** An item of a questionnaire. */
export interface Item {
  id: string;
  text: string;
  low: string;
  high: string;
}

/** A questionnaire: each item is rated from `first` to `last` in steps. */
export interface Form {
  title: string;
  instruction: string;
  first: number;
  last: number;
  step: number;
  items: Item[];
}

/** A condition: a combination of factor levels. */
export interface Condition {
  seat: "partner" | "helper";
  input: InputLevel;
}

/** Position of the condition (0 for practice), condition, episode, and name of the helper. If the server simulates, the
 * page has neither episode nor helper. */
export type Trial = [position: number, condition: number, episode?: number, helper?: string];

/** Content of the page of a study. */
export interface StudyContent {
  format: string;
  version: number;
  chaic: string;
  digest: string;
  title: string;
  consent: string;
  instructions: string;
  debrief: string;
  completion_code: string;
  play: { world: "waits" | "goes_on"; speed: number; simulator?: "server" };
  forms: Record<string, Form>;
  after_condition: string[];
  at_end: string[];
  conditions: Condition[];
  seed: number;
  /** True if the page belongs to a server, which gives out the slots and stores the records. */
  server?: boolean;
  /** Trials of each slot. */
  slots: Trial[][];
  /** Episodes (JSON); none if the server simulates. */
  episodes: string[];
}

/** Ratings by item; null for an item without an answer. */
export type Ratings = Record<string, number | null>;

/** Outcome of a trial. */
export type TrialOutcome = "ended" | "stopped" | "left";

/** A record of a participant's data (crates/eval/chaic-study/src/data.rs). */
export type DataRecord =
  | { type: "start"; format: string; version: number; chaic: string; study: string; code: string; slot: number }
  | { type: "instructed" }
  | { type: "trial"; trial: number }
  | { type: "trace"; trial: number; text: string }
  | { type: "trial_end"; trial: number; outcome: TrialOutcome }
  | { type: "answers"; position: number; form: string; ratings: Ratings }
  | { type: "complete" };

/** A step of the participation after the consent. */
export type Step =
  | { kind: "instructions" }
  | { kind: "trial"; number: number; trial: Trial }
  | { kind: "form"; position: number; name: string; other: string }
  | { kind: "debrief" };

/** Returns the steps of a slot (from 1). */
export function stepsOf(content: StudyContent, slot: number): Step[] {
  const trials = content.slots[slot - 1] ?? [];
  const steps: Step[] = [{ kind: "instructions" }];
  const other = (condition: number): string =>
    content.conditions[condition]?.seat === "helper" ? "partner" : "helper";
  trials.forEach((trial, number) => {
    steps.push({ kind: "trial", number, trial });
    const [position, condition] = trial;
    const isLast = trials[number + 1]?.[0] !== position;
    if (position === 0 || !isLast) return;
    for (const name of content.after_condition) {
      steps.push({ kind: "form", position, name, other: other(condition) });
    }
  });
  const last = trials.at(-1)?.[1] ?? 0;
  for (const name of content.at_end) steps.push({ kind: "form", position: 0, name, other: other(last) });
  return [...steps, { kind: "debrief" }];
}

/** Returns whether the records show that a step is done. */
function isDone(step: Step, records: DataRecord[]): boolean {
  return records.some((record) => {
    switch (step.kind) {
      case "instructions":
        return record.type === "instructed";
      case "trial":
        return record.type === "trial_end" && record.trial === step.number;
      case "form":
        return record.type === "answers" && record.position === step.position && record.form === step.name;
      case "debrief":
        return false;
    }
  });
}

/** Returns the index of the first step that is not done: the checkpoint. */
export function checkpoint(steps: Step[], records: DataRecord[]): number {
  const next = steps.findIndex((step) => !isDone(step, records));
  return next < 0 ? steps.length - 1 : next;
}

/** Returns the number of the trial that has begun and not ended. */
export function openTrial(records: DataRecord[]): number | undefined {
  const begun = records.filter((record) => record.type === "trial").at(-1);
  const isOpen = begun && !records.some((record) => record.type === "trial_end" && record.trial === begun.trial);
  return isOpen ? begun.trial : undefined;
}
