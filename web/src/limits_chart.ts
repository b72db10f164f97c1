// Chart of the partner's limits: the heights that it reaches, the mass that it lifts, and the objects of the task.

import { html, svg, type TemplateResult } from "lit";
import type { AgentInfo, TaskObject } from "./messages.js";

/** Size of the chart and its margins, pixels at its full width. */
const WIDTH = 320;
const HEIGHT = 210;
const LEFT = 46;
const BOTTOM = 40;
const TOP = 8;
const RIGHT = 12;
/** Masses at which the axis has marks, kilograms. */
const MASSES_KG = [0, 0.1, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500];
/** Distance between height marks, and the minimum height of the axis, meters. */
const STEP_M = 0.5;
const LEAST_M = 2;

/** Marks of objects beyond each limit. */
export const LIMIT_MARKS = {
  too_high: { mark: "↑", text: "too high" },
  too_low: { mark: "↓", text: "too low" },
  too_heavy: { mark: "■", text: "too heavy" },
};

/** Draws objects by mass (square root) and height of their tops, over the region that the partner can pick up. */
export function limitsChart(partner: AgentInfo, objects: TaskObject[]): TemplateResult {
  const [lowM, highM] = partner.reach_m;
  const maxKg = 1.1 * Math.max(0.5, ...objects.map((object) => object.mass_kg));
  const maxM = STEP_M * Math.ceil(Math.max(LEAST_M, ...objects.map((object) => object.top_m)) / STEP_M);
  const x = (kg: number): number => LEFT + (WIDTH - LEFT - RIGHT) * Math.sqrt(Math.min(kg / maxKg, 1));
  const y = (m: number): number => HEIGHT - BOTTOM - (HEIGHT - BOTTOM - TOP) * Math.min(m / maxM, 1);
  const heights = Array.from({ length: maxM / STEP_M + 1 }, (_, k) => k * STEP_M);
  const masses = spaced(MASSES_KG.filter((kg) => kg <= maxKg), x);
  const point = ({ name, limits, top_m, mass_kg }: TaskObject): TemplateResult => {
    const at = [x(mass_kg), y(Math.max(top_m, 0))];
    const title = svg`<title>${name}, top at ${top_m.toFixed(2)} m, ${mass_kg.toFixed(1)} kg</title>`;
    if (limits.length === 0) return svg`<circle cx=${at[0]!} cy=${at[1]!} r="4">${title}</circle>`;
    const marks = limits.map((limit) => LIMIT_MARKS[limit].mark).join("");
    return svg`<text class="beyond" x=${at[0]!} y=${at[1]! + 5} text-anchor="middle">${marks}${title}</text>`;
  };
  // The list below the chart has the objects beyond the limits in words.
  return html`<svg class="limits" viewBox="0 0 ${WIDTH} ${HEIGHT}" aria-hidden="true">
    ${svg`<rect class="region" x=${LEFT} y=${y(highM)} width=${x(partner.strength_kg) - LEFT}
      height=${y(lowM) - y(highM)}></rect>`}
    ${heights.map(
      (m) => svg`<line x1=${LEFT} x2=${WIDTH - RIGHT} y1=${y(m)} y2=${y(m)}></line>
        <text x=${LEFT - 6} y=${y(m) + 4} text-anchor="end">${m.toFixed(1)} m</text>`,
    )}
    ${masses.map((kg) => svg`<text x=${x(kg)} y=${HEIGHT - BOTTOM + 17} text-anchor="middle">${kg}</text>`)}
    ${svg`<text x=${(LEFT + WIDTH - RIGHT) / 2} y=${HEIGHT - 5} text-anchor="middle">mass, kg</text>`}
    ${objects.map(point)}
  </svg>`;
}

/** Returns the first value, and each further value whose label does not touch the previous label. */
function spaced(values: number[], x: (value: number) => number): number[] {
  const LEAST_PX = 26;
  return values.reduce<number[]>(
    (kept, value) => (kept.length > 0 && x(value) - x(kept.at(-1)!) < LEAST_PX ? kept : [...kept, value]),
    [],
  );
}
