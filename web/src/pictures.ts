// Canvases that show the images of a player.

import type { Picture } from "./messages.js";

/** Largest sides of views and map, pixels. Views have at most the size that helpers see. */
export const MAX_PX = { view: 512, map: 720 };

/** Returns the side of the image that fills an element, in steps, pixels. */
export function drawnSize(element: HTMLElement | undefined, max: number): number {
  const STEP = 64;
  const side = (element?.clientWidth ?? 0) * devicePixelRatio;
  return Math.min(Math.max(STEP * Math.ceil(side / STEP), STEP), max);
}

/** Shows an image. */
export function paint(canvas: HTMLCanvasElement | undefined, { width, height, rgba }: Picture): void {
  const context = canvas?.getContext("2d");
  if (!canvas || !context) return;
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  context.putImageData(new ImageData(rgba, width, height), 0, 0);
}
