// Position in a replay: playing, pausing and stepping. Each element that shows replays owns a clock.

import type { ReactiveController, ReactiveControllerHost } from "lit";
import { nearest } from "./frames.js";

export const SPEEDS = [0.5, 1, 2, 4, 8];

/** Frames that a clock moves through. */
export interface Frames {
  last: number;
  perSecond: number;
  /** Frames of events, in ascending order. */
  events: number[];
}

/** Position in a replay. */
export class PlaybackClock implements ReactiveController {
  frame = 0;
  isPlaying = false;
  speed = 1;
  private frames?: Frames;
  private lastTime = 0;
  private position = 0;

  /** `draw` shows a frame. `isBusy` returns whether a frame is still being drawn; playing then skips frames. */
  constructor(
    private readonly host: ReactiveControllerHost,
    private readonly draw: (frame: number) => void,
    private readonly isBusy: () => boolean,
  ) {
    host.addController(this);
  }

  hostDisconnected(): void {
    this.isPlaying = false;
  }

  /** Starts with other frames; undefined while there are none. */
  reset(frames?: Frames): void {
    this.frames = frames;
    this.isPlaying = false;
    this.host.requestUpdate();
  }

  /** Shows a frame and stops. */
  seek(frame: number): void {
    this.isPlaying = false;
    this.show(frame);
  }

  /** Plays or pauses. At the end, it starts again. */
  toggle(): void {
    if (!this.frames) return;
    if (this.frame >= this.frames.last) this.show(0);
    this.isPlaying = !this.isPlaying;
    this.lastTime = performance.now();
    if (this.isPlaying) requestAnimationFrame((time) => this.advance(time));
    this.host.requestUpdate();
  }

  /** Moves to the next or previous event. */
  jump(direction: 1 | -1): void {
    const found = nearest(this.frames?.events ?? [], this.frame, direction);
    if (found !== undefined) this.seek(found);
  }

  /** Handles the keys of a replay. */
  press(event: KeyboardEvent): void {
    const target = event.composedPath()[0] as HTMLElement;
    // Many keyboard layouts have brackets behind AltGr, which counts as Alt, or as Ctrl and Alt.
    const isBracket = event.altKey && ["[", "]"].includes(event.key);
    const isShortcut = event.metaKey || ((event.ctrlKey || event.altKey) && !isBracket);
    if (isShortcut || target.matches("select, input")) return;
    const step = event.shiftKey ? (this.frames?.perSecond ?? 30) : 1;
    const actions: Record<string, () => void> = {
      " ": () => this.toggle(),
      ArrowLeft: () => this.seek(this.frame - step),
      ArrowRight: () => this.seek(this.frame + step),
      "[": () => this.jump(-1),
      "]": () => this.jump(1),
      Home: () => this.seek(0),
      End: () => this.seek(this.frames?.last ?? 0),
    };
    const action = actions[event.key];
    // Buttons and summaries handle the space bar themselves.
    if (!action || (event.key === " " && target.matches("button, summary"))) return;
    event.preventDefault();
    action();
  }

  private show(frame: number): void {
    if (!this.frames) return;
    this.frame = Math.max(0, Math.min(Math.round(frame), this.frames.last));
    this.position = this.frame;
    this.draw(this.frame);
    this.host.requestUpdate();
  }

  private advance(time: number): void {
    if (!this.isPlaying || !this.frames) return;
    // A tab in the background gets no callbacks; afterwards the replay continues where it was. The
    // time of a callback can be earlier than the key press that started the replay.
    const elapsed = Math.max(0, Math.min(time - this.lastTime, 250)) / 1000;
    this.lastTime = time;
    this.position += elapsed * this.speed * this.frames.perSecond;
    const frame = Math.min(Math.floor(this.position), this.frames.last);
    if (frame !== this.frame && !this.isBusy()) {
      this.frame = frame;
      this.draw(frame);
    }
    if (this.frame >= this.frames.last) this.isPlaying = false;
    else requestAnimationFrame((next) => this.advance(next));
    this.host.requestUpdate();
  }
}
