// Workers of a page.

import type { Request, Response } from "./messages.js";

/** Starts a worker; `onResponse` receives its messages, `onError` the reason if it stops. */
export function startWorker(
  program: string,
  onResponse: (response: Response) => void,
  onError: (message: string) => void,
): Worker {
  const url = URL.createObjectURL(new Blob([program], { type: "text/javascript" }));
  const worker = new Worker(url);
  URL.revokeObjectURL(url);
  worker.onmessage = (event: MessageEvent<Response>) => onResponse(event.data);
  worker.onerror = (event) => onError(event.message || "the worker has stopped");
  return worker;
}

/** Sends one request to a worker of its own, and returns the response. An abort ends the worker and returns undefined. */
export function ask(program: string, request: Request, signal: AbortSignal): Promise<Response | undefined> {
  return new Promise((resolve) => {
    const answered = (response?: Response): void => {
      worker.terminate();
      resolve(response);
    };
    signal.addEventListener("abort", () => answered());
    const failed = (message: string): void => answered({ type: "error", message });
    const worker = startWorker(program, answered, failed);
    worker.postMessage(request);
  });
}
