// Positions and texts of frames.

/** Formats a frame as minutes and seconds of simulated time. */
export function clock(frame: number, framesPerSecond: number): string {
  const seconds = Math.floor(frame / framesPerSecond);
  return `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}

/** Formats the delivered part of the goal's value. */
export function delivered(done: number | string, total: number, unit: string): string {
  return `${done} of ${total}${unit && ` ${unit}`} delivered`;
}

/** Returns the nearest of these frames before or after a frame; undefined if there is none. */
export function nearest(frames: number[], from: number, direction: 1 | -1): number | undefined {
  const candidates = frames.filter((frame) => Math.sign(frame - from) === direction);
  if (candidates.length === 0) return undefined;
  return direction > 0 ? Math.min(...candidates) : Math.max(...candidates);
}

/** Returns the index of the last line at or before a frame; -1 before the first. */
export function lastBefore(lines: { frame: number }[], frame: number): number {
  let found = -1;
  lines.forEach((line, k) => {
    if (line.frame <= frame) found = k;
  });
  return found;
}
