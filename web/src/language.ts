// Prompts and answers of language models beside a replay.

import { html, nothing, type TemplateResult } from "lit";
import { clock, lastBefore } from "./frames.js";
import type { LanguageAgent, ReplayInfo } from "./messages.js";

/** Describes the last decision of each agent with a language model; `onSeek` receives the frame of another one. */
export function language(
  agents: LanguageAgent[],
  info: ReplayInfo,
  frame: number,
  onSeek: (frame: number) => void,
): (TemplateResult | typeof nothing)[] {
  return agents.map((agent) => {
    const { decisions, problem } = agent;
    const current = lastBefore(decisions, frame);
    const shown = decisions[current];
    const move = (name: string, k: number): TemplateResult =>
      html`<button type="button" ?disabled=${!decisions[k]} @click=${() => onSeek(decisions[k]!.frame)}>${name}</button> `;
    return html`<section class="language" aria-label="Language model of the ${agent.agent}">
      <h3>Language model of the ${agent.agent}${agent.model ? `: ${agent.model}` : nothing}</h3>
      ${problem ? html`<p class="problem">The prompts cannot be shown: ${problem}</p>` : nothing}
      ${decisions.length > 0
        ? html`<p>
            Decision ${current + 1} of ${decisions.length}
            ${move("Previous decision", current - 1)} ${move("Next decision", current + 1)}
          </p>`
        : nothing}
      ${shown
        ? html`<p><b>${clock(shown.frame, info.frames_per_second)}</b>: ${shown.text}</p>
            ${shown.passages.map(
              ({ heading, text }) => html`<details>
                <summary>${heading}</summary>
                <pre tabindex="0">${text}</pre>
              </details>`,
            )}
            ${current >= decisions.length - agent.n_left_out
              ? html`<p>Its messages are too long for this page; <code>chaic llm show</code> prints them.</p>`
              : nothing}`
        : nothing}
    </section>`;
  });
}
