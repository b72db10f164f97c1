// Content that a page carries: the module, the program of the worker, and compressed texts.

/** Decodes the base64 text of an element and decompresses it (raw deflate). */
export async function embedded(element: Element): Promise<ArrayBuffer> {
  const bytes = Uint8Array.from(atob(element.textContent!.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Response(stream).arrayBuffer();
}

/** Returns the module of the page. */
export const moduleBytes = (): Promise<ArrayBuffer> => embedded(document.getElementById("chaic-module")!);

/** Returns the program of the worker. */
export const workerSource = (): string => document.getElementById("chaic-worker")!.textContent!;
