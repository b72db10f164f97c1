// Styles of the elements. Colors have a contrast of at least 4.5 to the background in both schemes.

import { css } from "lit";

export const styles = css`
  :host {
    --ink: #1e2026;
    --faint: #5a5e66;
    --paper: #fafaf8;
    --line: #c9cbce;
    --partner: #b8341c;
    --helper: #0b6e72;
    --child: #8a6400;
    --good: #0f6b34;
    --bad: #a3171d;
    --accent: #174ea6;
    display: block;
    color: var(--ink);
    background: var(--paper);
  }
  @media (prefers-color-scheme: dark) {
    :host {
      --ink: #eceef1;
      --faint: #b4b8bf;
      --paper: #17191d;
      --line: #4a4e55;
      --partner: #ff8f78;
      --helper: #5fd0d4;
      --child: #f0c24a;
      --good: #6fdc98;
      --bad: #ff9d9d;
      --accent: #9cc1ff;
    }
  }
  h2 {
    font-size: 1.25rem;
    margin: 0 0 0.25rem;
  }
  h3 {
    font-size: 1rem;
    margin: 0.75rem 0 0.25rem;
  }
  p {
    margin: 0.25rem 0;
  }
  .small,
  figcaption {
    color: var(--faint);
    font-size: 0.875rem;
  }
  .badge {
    border: 2px solid;
    border-radius: 0.25rem;
    font-weight: 600;
    padding: 0 0.375rem;
  }
  .good {
    color: var(--good);
  }
  .bad,
  .problem {
    color: var(--bad);
  }
  .pictures {
    display: grid;
    gap: 0.75rem;
    grid-template-columns: repeat(auto-fit, minmax(min(16rem, 100%), 1fr));
  }
  figure {
    margin: 0;
  }
  figcaption {
    min-height: 3.75em;
    overflow-wrap: anywhere;
  }
  canvas {
    border-radius: 0.25rem;
    display: block;
    height: auto;
    width: 100%;
  }
  figure.a0 canvas {
    border-top: 4px solid var(--partner);
  }
  figure.a1 canvas {
    border-top: 4px double var(--helper);
  }
  .overlaid {
    overflow: hidden;
    position: relative;
  }
  canvas.layers,
  .trails {
    left: 0;
    pointer-events: none;
    position: absolute;
    top: 0;
    width: 100%;
  }
  .detected {
    background: rgb(0 0 0 / 70%);
    border-left: 3px solid #fff;
    color: #fff;
    font-size: 0.6875rem;
    padding: 0 0.25rem;
    pointer-events: none;
    position: absolute;
    transform: translateY(-50%);
    white-space: nowrap;
  }
  .detected.before {
    border-left: 0;
    border-right: 3px solid #fff;
    transform: translate(-100%, -50%);
  }
  fieldset.layers {
    border: 1px solid var(--line);
    border-radius: 0.25rem;
    display: flex;
    flex-wrap: wrap;
    gap: 0 1rem;
    margin: 0.5rem 0;
    min-width: 0;
    padding: 0.25rem 0.75rem;
  }
  .layers label {
    align-items: center;
    display: inline-flex;
    gap: 0.375rem;
    min-height: 2rem;
  }
  .layers input {
    accent-color: var(--accent);
    height: 1.25rem;
    margin: 0;
    width: 1.25rem;
  }
  .words {
    overflow-wrap: anywhere;
  }
  .words summary {
    cursor: pointer;
    min-height: 1.75rem;
  }
  .words ul {
    margin: 0;
    padding-left: 1.5rem;
  }
  svg.limits {
    display: block;
    max-width: 26rem;
    width: 100%;
  }
  .limits .region {
    fill: var(--partner);
    fill-opacity: 0.15;
    stroke: var(--partner);
  }
  .limits line {
    stroke: var(--line);
  }
  .limits text {
    fill: var(--ink);
    font-size: 12px;
  }
  .limits text.beyond {
    font-size: 15px;
    font-weight: 700;
  }
  .limits circle {
    fill: var(--ink);
    fill-opacity: 0.7;
  }
  .trails polyline {
    fill: none;
    stroke: var(--agent);
    stroke-width: 0.005px;
  }
  .trails polyline.run1 {
    stroke-dasharray: 0.02px 0.01px;
  }
  .trails circle {
    fill: var(--agent);
    stroke: #fff;
    stroke-width: 0.003px;
  }
  .trails circle.run1 {
    fill: #fff;
    stroke: var(--agent);
  }
  .chart {
    background: linear-gradient(var(--line), var(--line)) 0 50% / 100% 1px no-repeat;
    border: solid var(--line);
    border-width: 1px 0;
    cursor: pointer;
    display: block;
    height: 6rem;
    width: 100%;
  }
  .chart path {
    fill: none;
    stroke: var(--ink);
    stroke-width: 2px;
    vector-effect: non-scaling-stroke;
  }
  .chart path.run1 {
    stroke-dasharray: 6px 4px;
  }
  .chart path.now {
    stroke: var(--accent);
  }
  .plans {
    margin: 0;
    padding-left: 1.5rem;
  }
  .plans button {
    background: transparent;
    border: 1px solid var(--faint);
    border-radius: 0.25rem;
    color: inherit;
    cursor: pointer;
    font: inherit;
    margin: 0.125rem 0;
    min-height: 2.75rem;
    padding: 0.25rem 0.75rem;
    text-align: left;
    width: 100%;
  }
  .link {
    background: none;
    border: 0;
    color: var(--accent);
    cursor: pointer;
    font: inherit;
    min-height: 1.75rem;
    min-width: 1.75rem;
    padding: 0;
    text-decoration: underline;
  }
  .controls {
    align-items: center;
    display: flex;
    flex-wrap: wrap;
    gap: 0.5rem;
    margin: 0.5rem 0;
  }
  .controls button {
    background: transparent;
    border: 1px solid var(--faint);
    border-radius: 0.25rem;
    color: inherit;
    font: inherit;
    height: 2.75rem;
    min-width: 2.75rem;
  }
  .controls svg {
    display: block;
    fill: currentColor;
    height: 1.25rem;
    margin: auto;
    width: 1.25rem;
  }
  .controls select {
    background: var(--paper);
    color: inherit;
    font: inherit;
    height: 2.75rem;
  }
  .seek {
    flex: 1 1 12rem;
  }
  .seek input {
    height: 2.75rem;
    width: 100%;
  }
  .time {
    font-variant-numeric: tabular-nums;
  }
  .hidden {
    clip-path: inset(50%);
    height: 1px;
    overflow: hidden;
    position: absolute;
    width: 1px;
  }
  :focus-visible {
    outline: 3px solid var(--accent);
    outline-offset: 2px;
  }
  .timeline {
    display: grid;
    gap: 0.5rem;
    grid-template-columns: max-content 1fr;
  }
  .labels {
    font-size: 0.875rem;
  }
  .labels span,
  .row {
    display: block;
    height: 1.75rem;
    line-height: 1.75rem;
    position: relative;
  }
  .rows {
    cursor: pointer;
    overflow: hidden;
    position: relative;
    touch-action: pan-y;
  }
  .a0 {
    --agent: var(--partner);
  }
  .a1 {
    --agent: var(--helper);
  }
  .a2 {
    --agent: var(--child);
  }
  .bar {
    background: var(--agent);
    min-width: 1px;
    position: absolute;
    top: 50%;
    transform: translateY(-50%);
  }
  .bar.walk {
    height: 0.625rem;
  }
  .bar.interact {
    height: 1.25rem;
  }
  .bar.failed {
    background: none;
    border: 1px solid var(--agent);
    box-sizing: border-box;
    height: 1.25rem;
  }
  .bar.wait {
    height: 3px;
  }
  .mark {
    position: absolute;
    transform: translateX(-50%);
  }
  .row > .mark.a0,
  .row > .mark.a1,
  .row > .mark.a2 {
    color: var(--agent);
  }
  .now {
    background: var(--accent);
    bottom: 0;
    position: absolute;
    top: 0;
    width: 2px;
  }
  @media (forced-colors: active) {
    .bar,
    .now,
    .key {
      forced-color-adjust: none;
    }
  }
  .legend {
    color: var(--faint);
    font-size: 0.875rem;
  }
  .key {
    background: var(--faint);
    display: inline-block;
    margin: 0 0.25rem 0 0.75rem;
    vertical-align: middle;
    width: 1.5rem;
  }
  .key.walk {
    height: 0.5rem;
  }
  .key.interact {
    height: 1rem;
  }
  .key.failed {
    background: none;
    border: 1px solid var(--faint);
    height: 1rem;
  }
  .key.wait {
    height: 3px;
  }
  .key.triangle {
    background: none;
    width: auto;
  }
  .columns {
    display: grid;
    gap: 1.5rem;
    grid-template-columns: repeat(auto-fit, minmax(min(20rem, 100%), 1fr));
  }
  .story ol {
    list-style: none;
    margin: 0;
    max-height: 24rem;
    overflow-y: auto;
    padding: 0;
  }
  .story button {
    background: transparent;
    border: 0;
    border-left: 4px solid transparent;
    color: inherit;
    cursor: pointer;
    font: inherit;
    min-height: 2rem;
    padding: 0.125rem 0.5rem;
    text-align: left;
    width: 100%;
  }
  .story button[aria-current="step"] {
    border-left-color: var(--accent);
    font-weight: 600;
  }
  table {
    border-collapse: collapse;
    width: 100%;
  }
  caption {
    font-weight: 600;
    text-align: left;
  }
  th {
    font-weight: 400;
    text-align: left;
  }
  .number {
    font-variant-numeric: tabular-nums;
    text-align: right;
  }
  meter {
    width: 100%;
  }
  .seats button:not(.link),
  .seats select,
  .language button {
    font: inherit;
    min-height: 2rem;
    padding: 0 0.5rem;
  }
  .language pre {
    max-height: 24rem;
    overflow-y: auto;
    overflow-wrap: anywhere;
    white-space: pre-wrap;
  }
  .belief td:not(.number) {
    width: 55%;
  }
`;
