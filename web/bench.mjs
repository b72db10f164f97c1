// Speed of a page in Chromium: node bench.mjs FILE.html, for a page of `chaic view` or `chaic play`.

import { resolve } from "node:path";
import { launch } from "./test-kit.mjs";

const SEEKS = 40;
const PLAY_SECONDS = 3;
const GAME_SECONDS = 20;

const browser = await launch();
const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });

/** Plays the first game as the helper, always by the first plan; the world never waits long. */
async function game() {
  await page.getByRole("button", { name: "Start" }).click();
  await page.waitForFunction(() => document.querySelector("chaic-play")?.shown);
  return page.evaluate(async (seconds) => {
    const play = document.querySelector("chaic-play");
    const start = { time: performance.now(), frame: play.shown.frame };
    let [pictures, last, waiting] = [0, play.shown, 0];
    while (performance.now() - start.time < 1000 * seconds) {
      if (play.shown !== last) [pictures, last] = [pictures + 1, play.shown];
      if (play.shown.status === "waiting") {
        const begin = performance.now();
        play.choose(0);
        while (play.shown === last) await new Promise(requestAnimationFrame);
        waiting += performance.now() - begin;
      }
      await new Promise(requestAnimationFrame);
    }
    const elapsed = (performance.now() - start.time - waiting) / 1000;
    return {
      framesPerSecond: (play.shown.frame - start.frame) / elapsed,
      picturesPerSecond: pictures / elapsed,
    };
  }, GAME_SECONDS);
}

/** Seeks and plays the first replay. */
async function replay(start) {
  await page.waitForFunction(() => document.querySelector("chaic-replay")?.shown);
  const firstPictureMs = Date.now() - start;
  await page.waitForFunction(() => document.querySelector("chaic-replay").info.is_complete);
  const verifiedMs = Date.now() - start;
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
      // The worker draws frames in advance during the first second.
      await pause(1000);
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
      // Both agents run again through the whole episode.
      const begin = performance.now();
      for (const box of [...replay.shadowRoot.querySelectorAll(".layers input")].slice(1, 3)) box.click();
      while (!replay.layers.rerun?.is_complete) await pause(10);
      const rerunSeconds = (performance.now() - begin) / 1000;
      return {
        seekMedianMs: Math.round(times[seeks / 2]),
        seekMaxMs: Math.round(times[seeks - 1]),
        framesPerSecond: replay.frame / seconds,
        picturesPerSecond: n / seconds,
        rerunSeconds,
      };
    },
    { seeks: SEEKS, seconds: PLAY_SECONDS },
  );
  return { firstPictureMs, verifiedMs, ...measured };
}

const start = Date.now();
await page.goto(`file://${resolve(process.argv[2])}`);
const hasGame = (await page.locator("#game").count()) > 0;
console.log(JSON.stringify(hasGame ? await game() : await replay(start), null, 2));
await browser.close();
