// Append-only log of one participant in the browser's database. Nothing exists before the first record.

import type { DataRecord } from "./content.js";

const STORE = "records";
/** Store of the identity at the server, and its only key. */
const IDENTITY = "identity";
const IDENTITY_KEY = 1;

/** Identity of a participant at the server of a study. The data contain no token. */
export interface Identity {
  code: string;
  token: string;
  /** True if the participant has stopped, and the server may still have data. */
  isLeaving: boolean;
}

function settled<T>(request: IDBRequest<T>): Promise<T> {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

/** Returns an error that describes why the browser does not store data, and the remedy. */
function refusal(problem: unknown): Error {
  const reason = problem instanceof Error ? `${problem.name}: ${problem.message}` : "no reason given";
  return new Error(
    `this browser does not store your data (${reason}). ` +
      "Use a window that is not private, let this page store data, or free space on the disk. Then load this page again",
  );
}

/** Maximum time for which a reloaded page waits for the previous page, milliseconds. */
const LOCK_MS = 3000;

/** Returns whether no other tab has this log. The lock ends with the page. */
export function lock(name: string): Promise<boolean> {
  // Browsers have locks on secure pages only.
  if (!navigator.locks) return Promise.resolve(true);
  return new Promise((resolve) => {
    const hold = (): Promise<never> => {
      resolve(true);
      return new Promise(() => {});
    };
    navigator.locks.request(name, { signal: AbortSignal.timeout(LOCK_MS) }, hold).catch(() => resolve(false));
  });
}

/** Log of one participant. */
export class StudyLog {
  /** Number of records that the browser has stored. */
  nStored: number;
  /** Reason why the log takes no further records, so that the data have no gaps. */
  private failure?: Error;
  /** True if another tab deletes this log. */
  private isClosed = false;

  private constructor(
    private readonly name: string,
    private readonly database: IDBDatabase,
    /** All records in order. */
    readonly records: DataRecord[],
  ) {
    this.nStored = records.length;
    // Otherwise the deletion in another tab would wait for this one.
    database.onversionchange = () => {
      database.close();
      this.isClosed = true;
      this.failure = new Error("its data were deleted in another tab. Load this page again");
    };
  }

  /**
   * Opens the log with a name. Without `mayCreate`, returns undefined if it does not exist, and creates nothing. Throws
   * if the browser stores no data, for example in a private window.
   */
  static async open(name: string, mayCreate: boolean): Promise<StudyLog | undefined> {
    let isAbsent = false;
    try {
      // Some browsers refuse the call, others the request.
      const request = indexedDB.open(name, 1);
      request.onupgradeneeded = () => {
        if (mayCreate) {
          request.result.createObjectStore(STORE, { autoIncrement: true });
          request.result.createObjectStore(IDENTITY);
        } else {
          isAbsent = true;
          // This abort prevents the creation of the database.
          request.transaction!.abort();
        }
      };
      const database = await settled(request);
      const records = await settled(database.transaction(STORE).objectStore(STORE).getAll());
      return new StudyLog(name, database, records as DataRecord[]);
    } catch (problem) {
      if (isAbsent) return undefined;
      throw refusal(problem);
    }
  }

  /** Appends a record; resolves when the browser has stored it. */
  async append(record: DataRecord): Promise<void> {
    if (this.failure) throw this.failure;
    this.records.push(record);
    try {
      await this.change(STORE, (store) => store.add(record));
    } catch (problem) {
      // The numbers of later records stay those of the database.
      this.records.splice(this.records.indexOf(record), 1);
      this.failure ??= problem instanceof Error ? problem : refusal(problem);
      throw problem;
    }
    this.nStored += 1;
  }

  /** Returns the identity at the server of the study, if there is one. */
  async readIdentity(): Promise<Identity | undefined> {
    // Logs of earlier versions have no such store.
    if (this.isClosed || !this.database.objectStoreNames.contains(IDENTITY)) return undefined;
    const found = await settled(this.database.transaction(IDENTITY).objectStore(IDENTITY).get(IDENTITY_KEY));
    return found as Identity | undefined;
  }

  /** Stores the identity. */
  setIdentity(identity: Identity): Promise<void> {
    return this.change(IDENTITY, (store) => store.put(identity, IDENTITY_KEY));
  }

  /** Deletes all records and keeps the identity. */
  async clear(): Promise<void> {
    this.records.length = 0;
    this.nStored = 0;
    await this.change(STORE, (store) => store.clear());
  }

  private change(name: string, change: (store: IDBObjectStore) => void): Promise<void> {
    return new Promise((resolve, reject) => {
      // The server must not have a record that this browser loses when its machine stops.
      const transaction = this.database.transaction(name, "readwrite", { durability: "strict" });
      transaction.oncomplete = () => resolve();
      // A request that fails aborts the transaction, which has its error then.
      transaction.onabort = () => reject(refusal(transaction.error));
      change(transaction.objectStore(name));
    });
  }

  /** Deletes the log with all records. `onBlocked` is called if the deletion waits for another tab. */
  async delete(onBlocked: () => void): Promise<void> {
    this.database.close();
    const request = indexedDB.deleteDatabase(this.name);
    request.onblocked = onBlocked;
    await settled(request);
    this.records.length = 0;
  }

  /** Returns the data as JSON lines. */
  toText(): string {
    return this.records.map((record) => JSON.stringify(record) + "\n").join("");
  }
}
