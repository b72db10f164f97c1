// Prompts and answers of language models beside a replay.

import { html, nothing, type TemplateResult } from "lit";
import { clock, nearest } from "./frames.js";
import type { LanguageAgent, ReplayInfo } from "./messages.js";

/** Describes the last decisions of each agent with a language model; `onSeek` receives the frame of another selected decision. */
export function language(
  agents: LanguageAgent[],
  info: ReplayInfo,
  frame: number,
  onSeek: (frame: number) => void,
): TemplateResult[] {
  return agents.map((agent) => {
    const { decisions, problem } = agent;
    const frames = decisions.map((decision) => decision.frame);
    const current = Math.max(-1, ...frames.filter((at) => at <= frame));
    const move = (name: string, direction: 1 | -1): TemplateResult => {
      const to = nearest(frames, current, direction);
      return html`<button type="button" ?disabled=${to === undefined} @click=${() => onSeek(to!)}>${name}</button> `;
    };
    const shown = decisions.map((decision, k) => ({ ...decision, number: k + 1 })).filter((d) => d.frame === current);
    return html`<section class="language" aria-label="Language model of the ${agent.agent}">
      <h3>Language model of the ${agent.agent}${agent.model ? `: ${agent.model}` : nothing}</h3>
      ${problem ? html`<p class="problem">The prompts cannot be shown: ${problem}</p>` : nothing}
      ${decisions.length > 0 ? html`<p>${move("Previous decision", -1)} ${move("Next decision", 1)}</p>` : nothing}
      ${shown.map(
        ({ number, text, passages }) => html`<p>
            Decision ${number} of ${decisions.length}, <b>${clock(current, info.frames_per_second)}</b>: ${text}
          </p>
          ${passages.map(
            (passage) => html`<details>
              <summary>${passage.heading}</summary>
              <pre tabindex="0">${passage.text}</pre>
            </details>`,
          )}
          ${number > decisions.length - agent.n_left_out
            ? html`<p>Its messages are too long for this page; <code>chaic llm show</code> prints them.</p>`
            : nothing}`,
      )}
    </section>`;
  });
}
