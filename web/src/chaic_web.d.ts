// The module (crates/app/chaic-web/src/bindings.rs), as its glue exports it.

declare module "*/chaic_web.js" {
  export function initSync(options: { module: ArrayBuffer }): void;

  export class Picture {
    readonly width: number;
    readonly height: number;
    rgba(): Uint8Array;
    labels(): string;
    free(): void;
  }

  export class Live {
    constructor(episode: Uint8Array, config: string);
    static take_over(trace: Uint8Array, episode: Uint8Array, frame: number, config: string): Live;
    info(): string;
    advance(frames: number): void;
    state(): string;
    choose_plan(plan: string): boolean;
    act(action: string): boolean;
    trace(): string;
    trace_after(n_lines: number): string;
    n_lines(): number;
    reference_rate(episode: Uint8Array, helper: string): number;
    view(side: number): Picture;
    free(): void;
  }

  export function continued_trace(trace: Uint8Array, episode: Uint8Array, frame: number, helper: string): string;

  export class Player {
    constructor(trace: Uint8Array, episode: Uint8Array);
    verify(frames: number): boolean;
    info(): string;
    seek(frame: number): string;
    view(agent: number, side: number): Picture;
    rerun_agents(): string;
    memory(agent: number): string;
    explored(agent: number): Uint8Array;
    task_objects(): string;
    map(width: number): Picture;
    free(): void;
  }
}
