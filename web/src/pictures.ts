// Canvases that show the images of a player.

import type { MapPicture, Picture } from "./messages.js";

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

/** Shows a map and writes its text. */
export function paintMap(canvas: HTMLCanvasElement | undefined, map: MapPicture): void {
  paint(canvas, map);
  const context = canvas?.getContext("2d");
  if (!context) return;
  context.lineJoin = "round";
  context.lineWidth = 2;
  for (const { text, at, font_px, width_px, align, color, border } of map.labels) {
    context.font = `${font_px.toFixed(1)}px ui-monospace, Menlo, Consolas, monospace`;
    context.textAlign = align;
    if (border) {
      context.strokeStyle = `rgb(${border.join(" ")})`;
      context.strokeText(text, ...at, width_px);
    }
    context.fillStyle = `rgb(${color.join(" ")})`;
    context.fillText(text, ...at, width_px);
  }
}
