// Player of one replay in a worker. If several requests come while the worker draws, only the last is executed.

import type {
  FrameState,
  LanguageAgent,
  LayerData,
  MapPicture,
  Picture,
  ReplayInfo,
  Request,
  RerunState,
  Response,
  Wanted,
} from "./messages.js";
import { startWorker } from "./workers.js";

/** Drawn frame. */
export interface DrawnFrame {
  state: FrameState;
  views: Picture[];
  map: MapPicture | null;
  layers: LayerData;
}

/** Inputs of a player. */
export interface Source {
  module: ArrayBuffer;
  trace: Uint8Array;
  episode: Uint8Array;
  /** Prompts and answers of agents with a language model. */
  language: LanguageAgent[];
}

/** Player in a worker. */
export class ReplayPlayer {
  private readonly worker: Worker;
  private isBusy = false;
  private next: number | undefined;
  private isOpen = false;
  private onRerun?: (state: RerunState) => void;

  /**
   * Opens a replay. `wanted` returns what is drawn next. `onInfo` receives the facts twice: when the first frame can be drawn, and when the
   * whole replay is verified. `onFrame` receives frames, `onError` the reason if the replay cannot be shown.
   */
  constructor(
    workerSource: string,
    source: Source,
    private readonly wanted: () => Wanted,
    private readonly onInfo: (info: ReplayInfo) => void,
    private readonly onFrame: (frame: DrawnFrame) => void,
    private readonly onError: (message: string) => void,
  ) {
    this.worker = startWorker(workerSource, (response) => this.receive(response), onError);
    const { module, trace, episode } = source;
    this.post({ type: "open", module, trace, episode });
  }

  /** Shows a frame, as soon as the worker is free. */
  seek(frame: number): void {
    this.next = frame;
    this.drawNext();
  }

  /** Runs partner and helper again beside the replay; `onProgress` receives how far they are. */
  rerun(onProgress: (state: RerunState) => void): void {
    this.onRerun = onProgress;
    const request: Request = { type: "rerun" };
    this.worker.postMessage(request);
  }

  /** True while a frame is drawn. */
  get isDrawing(): boolean {
    return this.isBusy;
  }

  /** Ends the worker. */
  close(): void {
    this.worker.terminate();
  }

  private post(request: Request): void {
    this.isBusy = true;
    this.worker.postMessage(request);
  }

  private drawNext(): void {
    if (this.isBusy || this.next === undefined || !this.isOpen) return;
    const frame = this.next;
    this.next = undefined;
    this.post({ type: "frame", frame, ...this.wanted() });
  }

  private receive(response: Response): void {
    if (response.type === "rerun") {
      this.onRerun?.(response.state);
      return;
    }
    if (response.type === "verified") {
      this.onInfo(response.info);
      return;
    }
    this.isBusy = false;
    if (response.type === "opened") {
      this.isOpen = true;
      this.onInfo(response.info);
    } else if (response.type === "frame") {
      this.onFrame(response);
    } else if (response.type === "error") {
      this.onError(response.message);
    }
    this.drawNext();
  }
}
