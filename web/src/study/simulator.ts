// Simulator on the server of a study (crates/app/chaic-study-server/src/play_routes.rs): the requests of a game, one
// after the other. A request without an answer is repeated with the same turn number, so no turn is performed twice.

import type { LiveState, Picture, Request, Response, Simulator } from "../messages.js";
import type { Answer, Participant } from "./server.js";

/** Minimum time between two pictures, milliseconds. */
const INTERVAL_MS = 70;
const LINE_END = 10;

/** Decodes a picture. */
async function decoded(png: Uint8Array<ArrayBuffer>): Promise<Picture> {
  const bitmap = await createImageBitmap(new Blob([png], { type: "image/png" }));
  const { width, height } = bitmap;
  const context = new OffscreenCanvas(width, height).getContext("2d")!;
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  const rgba = context.getImageData(0, 0, width, height).data as Uint8ClampedArray<ArrayBuffer>;
  return { width, height, rgba };
}

/** Simulator of an episode on the server. */
export class ServerSimulator implements Simulator {
  private next = 0;
  private last: Promise<void> = Promise.resolve();
  private isClosed = false;
  private lastTime = 0;

  /** `onConnection` is called when the connection is lost and when it is back. */
  constructor(
    private readonly participant: Participant,
    private readonly trial: number,
    private readonly receive: (response: Response) => void,
    private readonly onConnection: (isLost: boolean) => void,
  ) {}

  post(request: Request): void {
    this.last = this.last
      .then(() => this.answer(request))
      .catch((problem: unknown) => this.send({ type: "error", message: String(problem) }));
  }

  close(): void {
    this.isClosed = true;
  }

  private send(response: Response): void {
    if (!this.isClosed) this.receive(response);
  }

  private async request(path: string, body?: string): Promise<Answer> {
    let isLost = false;
    const change = (to: boolean): void => {
      if (to !== isLost) this.onConnection((isLost = to));
    };
    const answer = await this.participant.repeated("PUT", `/trials/${this.trial}${path}`, body, () => change(true));
    change(false);
    return answer;
  }

  private async answer(request: Request): Promise<void> {
    if (this.isClosed) return;
    if (request.type === "play") await this.open();
    // The server stores the trace.
    else if (request.type === "trace") this.send({ type: "trace", trace: "" });
    else if (request.type === "advance") await this.advance(request);
  }

  private async open(): Promise<void> {
    const answer = await this.request("");
    if (!answer.info) return this.refused(answer);
    this.next = answer.next ?? 0;
    this.send({ type: "playing", info: answer.info });
  }

  /** Handles an answer without content: the episode is over, closed or cannot go on. */
  private refused({ status, error }: Answer): void {
    // Requests end without an answer when the participant stops.
    if (status === 0) return;
    if (status === 410) this.send({ type: "over" });
    else this.send({ type: "error", message: error ?? `the server answers ${status}` });
  }

  private async advance(request: Extract<Request, { type: "advance" }>): Promise<void> {
    const wait = this.lastTime + INTERVAL_MS - performance.now();
    if (wait > 0) await new Promise((resolve) => setTimeout(resolve, wait));
    this.lastTime = performance.now();
    const { frames, viewPx: view_px, input } = request;
    let answer = await this.request(`/turns/${this.next}`, JSON.stringify({ frames, view_px, input }));
    if (answer.status === 409) {
      // The server has started again, or another request was the last one. The person decides again.
      const opened = await this.request("");
      if (!opened.info) return this.refused(opened);
      this.next = opened.next ?? 0;
      answer = await this.request(`/turns/${this.next}`, JSON.stringify({ frames: 0, view_px }));
    }
    if (!answer.bytes) return this.refused(answer);
    this.next += 1;
    const end = answer.bytes.indexOf(LINE_END);
    const state = JSON.parse(new TextDecoder().decode(answer.bytes.subarray(0, end))) as LiveState;
    this.send({ type: "live", state, view: await decoded(answer.bytes.slice(end + 1)) });
  }
}
