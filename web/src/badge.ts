// Badge: fraction of a replay that is verified.

import { html, type TemplateResult } from "lit";
import type { ReplayInfo } from "./messages.js";

/** Shows how many decisions of a replay agree with its re-simulation. */
export function badge(info: ReplayInfo): TemplateResult {
  const verified = info.n_verified === info.n_decisions;
  return html`<span class="badge ${verified ? "good" : "bad"}">
    ${verified ? "verified" : "not verified"}: ${info.n_verified} of ${info.n_decisions} decisions
  </span>`;
}
