// Shared by the tests and measurements of the pages: CHAIC names the command, CHROMIUM the browser, or FIREFOX another one.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import playwright from "playwright-core";

/** The command line program. */
export const chaic = process.env.CHAIC ?? "chaic";

/** Source of the accessibility checker, to be evaluated in a page. */
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Path of Firefox, if the tests run there. */
export const firefox = process.env.FIREFOX;

/** Starts the browser. Firefox as distributed speaks WebDriver BiDi, which this release supports without documentation. */
export const launch = () =>
  firefox
    ? playwright._bidiFirefox.launch({ executablePath: firefox })
    : playwright.chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox"] });

/** Chooses the first plan of a game by its key until a frame. */
export async function playTo(page, frame) {
  await page.waitForFunction(
    (until) => {
      const play = document.querySelector("chaic-play");
      if (play?.shown?.status === "waiting") {
        play.shadowRoot.querySelector("section").dispatchEvent(new KeyboardEvent("keydown", { key: "1" }));
      }
      return play?.shown?.frame >= until;
    },
    frame,
    { timeout: 60_000, polling: 30 },
  );
}

/** Returns the findings of axe as text, one for each kind. */
export async function findings(page) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run());
  return violations.map((v) => `${v.id}: ${v.nodes.map((n) => n.html).join(" ")}`);
}

/** Returns the width that the content of a page needs, pixels. */
export const scrollWidth = (page) => page.evaluate(() => document.documentElement.scrollWidth);
