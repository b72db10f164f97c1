// Timeline of a replay: deliveries, and a row per agent with its activities.

import { html, type TemplateResult } from "lit";
import { styleMap } from "lit/directives/style-map.js";
import type { Activity, ReplayInfo } from "./messages.js";

/** Draws the timeline up to a frame `end`; `onSeek` receives the frame that a pointer selects. */
export function timeline(
  info: ReplayInfo,
  frame: number,
  onSeek: (frame: number) => void,
  end = info.length,
): TemplateResult {
  const { activities, deliveries } = info.timeline;
  const percent = (at: number): string => `${((100 * at) / Math.max(end, 1)).toFixed(3)}%`;
  const seek = (event: PointerEvent): void => {
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    onSeek(((event.clientX - box.left) / box.width) * end);
  };
  const bar = (activity: Activity): TemplateResult => {
    const isFailure = activity.failed && activity.kind === "interact";
    const place = { left: percent(activity.start), width: percent(activity.end - activity.start) };
    const kind = isFailure ? "failed" : activity.kind;
    const mark = isFailure
      ? html`<span class="mark" style=${styleMap({ left: percent(activity.end) })}>×</span>`
      : "";
    return html`<span class="bar ${kind}" style=${styleMap(place)}></span>${mark}`;
  };
  // The list of events has the same content, for screen readers.
  return html`<div class="timeline" aria-hidden="true">
    <div class="labels">
      <span>deliveries</span>
      ${info.agents.map((agent) => html`<span>${agent.name}</span>`)}
    </div>
    <div
      class="rows"
      @pointerdown=${seek}
      @pointermove=${(event: PointerEvent) => event.buttons === 1 && seek(event)}
    >
      <div class="row">
        ${deliveries.map(
          ({ frame: at, by }) =>
            html`<span class="mark a${by}" style=${styleMap({ left: percent(at) })}>▼</span>`,
        )}
      </div>
      ${info.agents.map(
        ({ id }) => html`<div class="row a${id}">
          ${activities.filter((activity) => activity.agent === id).map(bar)}
        </div>`,
      )}
      <span class="now" style=${styleMap({ left: percent(frame) })}></span>
    </div>
  </div>`;
}
