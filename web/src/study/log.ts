// Append-only log of one participant in the browser's database. Nothing exists before the first record.

import type { DataRecord } from "./content.js";

const STORE = "records";

function settled<T>(request: IDBRequest<T>): Promise<T> {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

/** Longest time for which a reload waits for the page before it, milliseconds. */
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
  private constructor(
    private readonly name: string,
    private readonly database: IDBDatabase,
    /** All records in order. */
    readonly records: DataRecord[],
  ) {}

  /** Opens the log with a name. Without `mayCreate`, returns undefined if it does not exist, and creates nothing. */
  static async open(name: string, mayCreate: boolean): Promise<StudyLog | undefined> {
    const request = indexedDB.open(name, 1);
    let isRefused = false;
    request.onupgradeneeded = () => {
      if (mayCreate) request.result.createObjectStore(STORE, { autoIncrement: true });
      else {
        isRefused = true;
        // The database does not come into being.
        request.transaction!.abort();
      }
    };
    try {
      const database = await settled(request);
      const records = await settled(database.transaction(STORE).objectStore(STORE).getAll());
      return new StudyLog(name, database, records as DataRecord[]);
    } catch (problem) {
      if (isRefused) return undefined;
      throw problem;
    }
  }

  /** Appends a record; resolves when the browser has stored it. */
  append(record: DataRecord): Promise<void> {
    this.records.push(record);
    return new Promise((resolve, reject) => {
      const transaction = this.database.transaction(STORE, "readwrite");
      transaction.oncomplete = () => resolve();
      transaction.onabort = transaction.onerror = () => reject(transaction.error);
      transaction.objectStore(STORE).add(record);
    });
  }

  /** Deletes the log with all records. */
  async delete(): Promise<void> {
    this.database.close();
    await settled(indexedDB.deleteDatabase(this.name));
    this.records.length = 0;
  }

  /** Returns the data as JSON lines. */
  toText(): string {
    return this.records.map((record) => JSON.stringify(record) + "\n").join("");
  }
}
