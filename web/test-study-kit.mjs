// Shared by the tests of studies: the server of a study, and participants who use the keyboard.

import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { existsSync, readdirSync } from "node:fs";
import { chaic } from "./test-kit.mjs";

const probe = spawnSync(chaic, ["study", "serve", "absent.toml", "--data", "absent"], { encoding: "utf8" });
/** Reason to skip tests with a server, or false. */
export const skip = probe.stderr.includes("no study server") ? "this build of chaic has no study server" : false;

/** Servers that were started. */
const servers = [];

/** Starts `chaic study serve` and returns its process and address. */
export async function serve(definition, data, listen = "127.0.0.1:0", options = []) {
  const command = ["study", "serve", definition, "--data", data, "--listen", listen, "--format", "json", ...options];
  const server = spawn(chaic, command, { stdio: ["ignore", "pipe", "inherit"] });
  servers.push(server);
  let printed = "";
  for await (const text of server.stdout) {
    printed += text;
    if (printed.trimEnd().endsWith("}")) break;
  }
  return { server, url: JSON.parse(printed).url };
}

/** Ends a server by Ctrl-C and returns its exit code. */
export function end(server) {
  return new Promise((resolve) => {
    server.once("exit", (code) => resolve(code));
    server.kill("SIGINT");
  });
}

/** Kills the servers that a failed test has left. */
export function killServers() {
  for (const server of servers) server.kill();
}

/** Returns the files of participants in a folder. */
export const dataFiles = (data) =>
  existsSync(data) ? readdirSync(data).filter((name) => name.endsWith(".jsonl")) : [];

/** Waits for the heading of a page. */
export const heading = (page, text) => page.getByRole("heading", { level: 1, name: text }).waitFor();

/** Moves the focus by Tab to an element whose text or label matches, and presses a key there. */
export async function tabTo(page, wanted, key = "Enter") {
  for (let n = 0; n < 80; n++) {
    await page.keyboard.press("Tab");
    const name = await page.evaluate(() => {
      let focused = document.activeElement;
      while (focused?.shadowRoot?.activeElement) focused = focused.shadowRoot.activeElement;
      return `${focused?.textContent.trim()} ${focused?.getAttribute("aria-label") ?? ""}`;
    });
    if (wanted.test(name)) {
      await page.keyboard.press(key);
      return;
    }
  }
  assert.fail(`no element ${wanted}`);
}

/** Presses the key of the first plan until a frame. */
export async function playByKeys(page, frame) {
  for (;;) {
    const shown = await page.evaluate(() => document.querySelector("chaic-play")?.shown);
    if (shown?.frame >= frame) return;
    if (shown?.status === "waiting") await page.keyboard.press("1");
    await page.waitForTimeout(50);
  }
}
