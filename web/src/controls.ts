// Buttons and slider of a clock.

import { html, svg, type TemplateResult } from "lit";
import { SPEEDS, type PlaybackClock } from "./clock.js";
import { clock } from "./frames.js";

/** Shapes of the buttons, in a square of 20 units. */
const ICONS = {
  previous: "M3 3h3v14H3z M17 3v14L7 10z",
  back: "M15 3v14L5 10z",
  play: "M5 3v14l12-7z",
  pause: "M4 3h4v14H4z M12 3h4v14h-4z",
  forward: "M5 3v14l10-7z",
  next: "M14 3h3v14h-3z M3 3v14l10-7z",
};

/** Draws the controls of a replay with frames 0 to `last`; `status` is the text at the end. */
export function controls(
  playback: PlaybackClock,
  last: number,
  framesPerSecond: number,
  status: string,
): TemplateResult {
  const button = (label: string, icon: keyof typeof ICONS, action: () => void): TemplateResult =>
    html`<button type="button" aria-label=${label} title=${label} @click=${action}>
      <svg viewBox="0 0 20 20" aria-hidden="true">${svg`<path d=${ICONS[icon]}></path>`}</svg>
    </button>`;
  const [toggle, toggleIcon] = playback.isPlaying
    ? (["Pause (space)", "pause"] as const)
    : (["Play (space)", "play"] as const);
  const { frame, speed } = playback;
  return html`<div class="controls" role="group" aria-label="Playback">
    ${button("Previous event ([)", "previous", () => playback.jump(-1))}
    ${button("Previous frame (left arrow)", "back", () => playback.seek(frame - 1))}
    ${button(toggle, toggleIcon, () => playback.toggle())}
    ${button("Next frame (right arrow)", "forward", () => playback.seek(frame + 1))}
    ${button("Next event (])", "next", () => playback.jump(1))}
    <label>
      Speed
      <select @change=${(event: Event) => (playback.speed = Number((event.target as HTMLSelectElement).value))}>
        ${SPEEDS.map((choice) => html`<option value=${choice} ?selected=${choice === speed}>${choice}x</option>`)}
      </select>
    </label>
    <label class="seek">
      <span class="hidden">Frame</span>
      <input
        type="range"
        min="0"
        max=${last}
        .value=${String(frame)}
        aria-valuetext="${clock(frame, framesPerSecond)} of ${clock(last, framesPerSecond)}"
        @input=${(event: Event) => playback.seek(Number((event.target as HTMLInputElement).value))}
      />
    </label>
    <span class="time">${clock(frame, framesPerSecond)} / ${clock(last, framesPerSecond)}, frame ${frame}</span>
    <span class="time">${status}</span>
  </div>`;
}
