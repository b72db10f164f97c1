// The module (crates/app/chaic-web/src/bindings.rs), as its glue exports it.

declare module "*/chaic_web.js" {
  export function initSync(options: { module: ArrayBuffer }): void;

  export class Picture {
    readonly width: number;
    readonly height: number;
    rgba(): Uint8Array;
    free(): void;
  }

  export class Player {
    constructor(trace: Uint8Array, episode: Uint8Array);
    info(): string;
    seek(frame: number): string;
    view(agent: number, side: number): Picture;
    map(width: number): Picture;
    free(): void;
  }
}
