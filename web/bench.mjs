// Speed of a page in Chromium: node bench.mjs FILE.html

import { resolve } from "node:path";
import { chromium } from "playwright-core";

const SEEKS = 40;
const PLAY_SECONDS = 3;

const executablePath = process.env.CHROMIUM ?? "/usr/bin/chromium";
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
const start = Date.now();
await page.goto(`file://${resolve(process.argv[2])}`);
await page.waitForFunction(() => document.querySelector("chaic-replay")?.shown);
const first = Date.now() - start;
const measured = await page.evaluate(
  async ({ seeks, seconds }) => {
    const replay = document.querySelector("chaic-replay");
    const pause = (ms) => new Promise((done) => setTimeout(done, ms));
    const seek = async (frame) => {
      const begin = performance.now();
      replay.seek(frame);
      while (replay.shown.frame !== frame || replay.player.isDrawing) await pause(1);
      return performance.now() - begin;
    };
    const last = replay.info.last_frame;
    const times = [];
    for (let k = 0; k < seeks; k++) times.push(await seek((k * 997) % last));
    times.sort((a, b) => a - b);
    await seek(0);
    let n = 0;
    replay.addEventListener("moved", () => n++);
    const play = replay.shadowRoot.querySelectorAll(".controls button")[2];
    play.click();
    await pause(1000 * seconds);
    play.click();
    return {
      seekMedianMs: Math.round(times[seeks / 2]),
      seekMaxMs: Math.round(times[seeks - 1]),
      framesPerSecond: replay.frame / seconds,
      picturesPerSecond: n / seconds,
    };
  },
  { seeks: SEEKS, seconds: PLAY_SECONDS },
);
console.log(JSON.stringify({ firstPictureMs: first, ...measured }, null, 2));
await browser.close();
