// Requests to the server of a study (crates/app/chaic-study-server/src/routes.rs), and the upload of a log.
// All requests can be repeated, so a lost answer loses nothing.

import type { LiveInfo } from "../messages.js";
import type { DataRecord } from "./content.js";
import type { Identity, StudyLog } from "./log.js";

/** Time limit of a request, milliseconds. */
const TIMEOUT_MS = 30_000;
/** Pauses before a repetition, milliseconds: the first, and the longest after doubling. */
const PAUSE_MS = [1000, 30_000] as const;
/** Maximum size of the records in a request, characters. A longer record is sent alone. */
const BATCH_LENGTH = 200_000;
/** Size up to which a request outlives its page; browsers allow 64 KiB. */
const KEEPALIVE_LENGTH = 20_000;
const TOKEN_BYTES = 32;

/** Draws a token. */
export function drawToken(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(TOKEN_BYTES));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Answer of the server. */
export interface Answer {
  /** Status of HTTP; 0 if there was no answer. */
  status: number;
  start?: DataRecord;
  stored?: number;
  error?: string;
  /** Facts about an episode that is open on the server. */
  info?: LiveInfo;
  /** Number of the next turn. */
  next?: number;
  /** Body that is no JSON. */
  bytes?: Uint8Array<ArrayBuffer>;
}

/** Returns whether a repetition of the request can succeed. */
const canRepeat = ({ status }: Answer): boolean =>
  status === 0 || status === 408 || status === 429 || status >= 500;

/** Waits before the repetition with this number; ends at once when the browser is online again. */
function pause(number: number): Promise<void> {
  const [first, longest] = PAUSE_MS;
  return new Promise((resolve) => {
    const done = (): void => {
      clearTimeout(timer);
      removeEventListener("online", done);
      resolve();
    };
    const timer = setTimeout(done, Math.min(first * 2 ** number, longest));
    addEventListener("online", done);
  });
}

/** Result of the request for a slot. */
export type Entry = { start: DataRecord; stored: number } | "full" | "taken" | "aborted";

/** Requests of one participant. */
export class Participant {
  private readonly aborted = new AbortController();

  constructor(private readonly identity: Identity) {}

  /** Ends all requests and repetitions. */
  abort(): void {
    this.aborted.abort();
  }

  /** Asks for a slot until the server answers. */
  async enter(): Promise<Entry> {
    const { status, start, stored, error } = await this.repeated("PUT", "");
    if (status === 0) return "aborted";
    if (start && stored !== undefined) return { start, stored };
    if (status === 410) return "full";
    if (status === 401) return "taken";
    throw new Error(error ?? `the server answers ${status}`);
  }

  /** Deletes all data on the server; resolves when it has confirmed. */
  async delete(): Promise<void> {
    const { status, error } = await this.repeated("DELETE", "");
    if (status !== 200 && status !== 404) throw new Error(error ?? `the server answers ${status}`);
  }

  /** Returns the file on the server after the end of the study; undefined if there is no connection. */
  async data(): Promise<Uint8Array<ArrayBuffer> | undefined> {
    const { bytes, error } = await this.request("GET", "/data");
    if (error !== undefined) throw new Error(error);
    return bytes;
  }

  /** Sends a request until it has an answer that does not ask for a repetition; status 0 after an abort. */
  async repeated(method: string, path: string, body?: string, onFailure?: () => void): Promise<Answer> {
    for (let number = 0; ; number++) {
      const answer = await this.request(method, path, body);
      if (this.aborted.signal.aborted || !canRepeat(answer)) return answer;
      onFailure?.();
      await pause(number);
    }
  }

  private async request(method: string, path: string, body?: string): Promise<Answer> {
    const { code, token } = this.identity;
    try {
      const response = await fetch(`participants/${code}${path}`, {
        method,
        body,
        headers: { Authorization: `Bearer ${token}` },
        cache: "no-store",
        keepalive: (body?.length ?? 0) < KEEPALIVE_LENGTH,
        signal: AbortSignal.any([this.aborted.signal, AbortSignal.timeout(TIMEOUT_MS)]),
      });
      if (response.headers.get("Content-Type") === "application/octet-stream") {
        return { status: response.status, bytes: new Uint8Array(await response.arrayBuffer()) };
      }
      return { ...((await response.json()) as object), status: response.status };
    } catch {
      // No connection, a time-out, or an answer that is not from the server of the study.
      return { status: 0 };
    }
  }
}

/** State of an upload: all is stored, records wait for a connection, or the server refuses them. */
export type UploadState = "saved" | "sending" | "waiting" | "refused";

/** Upload of a log, in order and one request at a time. */
export class Upload {
  state: UploadState = "sending";
  /** Reason of a refusal. */
  problem = "";
  private isRunning = false;
  private waiters: (() => void)[] = [];

  /** `stored` is the number of records on the server, if known. `onChange` is called when the state changes. */
  constructor(
    private readonly participant: Participant,
    private readonly log: StudyLog,
    private stored: number | undefined,
    /** True if the server appends ends of episodes by itself. */
    private readonly isServerWriting: boolean,
    private readonly onChange: () => void,
  ) {}

  /** Ends the upload. */
  stop(): void {
    this.participant.abort();
  }

  /** Sends all records that the browser has stored. Call it after each append. */
  async send(): Promise<void> {
    if (this.isRunning || this.state === "refused") return;
    this.isRunning = true;
    while (this.stored === undefined || this.stored < this.log.nStored) {
      const known = this.stored;
      if (this.state === "saved") this.set("sending");
      const answer =
        known === undefined
          ? await this.participant.repeated("GET", "", undefined, () => this.set("waiting"))
          : await this.participant.repeated("PUT", `/records/${known}`, this.batch(known), () => this.set("waiting"));
      if (answer.status === 0) return;
      // The server reports its number of records even if records before the sent ones are missing.
      const n = this.log.records.length + (this.isServerWriting ? 1 : 0);
      if (answer.stored === undefined || answer.stored > n) {
        this.problem = answer.error ?? "the server has more data than this browser";
        this.set("refused");
        return;
      }
      this.stored = answer.stored;
    }
    this.isRunning = false;
    this.set("saved");
    for (const done of this.waiters.splice(0)) done();
  }

  /** Resolves when the server has all records that the browser has stored. */
  async sent(): Promise<void> {
    const done = new Promise<void>((resolve) => this.waiters.push(resolve));
    await this.send();
    await done;
  }

  private set(state: UploadState): void {
    if (state === this.state) return;
    this.state = state;
    this.onChange();
  }

  /** Returns the lines of the next records. */
  private batch(from: number): string {
    let text = "";
    for (const record of this.log.records.slice(from, this.log.nStored)) {
      const line = JSON.stringify(record) + "\n";
      if (text !== "" && text.length + line.length > BATCH_LENGTH) break;
      text += line;
    }
    return text;
  }
}
