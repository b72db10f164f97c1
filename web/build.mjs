// Builds the module and the scripts of the pages into crates/eval/chaic-page/bundle. `--check` compares them
// with the committed files instead; `--scripts` builds the scripts of the pages alone.

import { execFileSync } from "node:child_process";
import {
  existsSync,
  mkdirSync,
  mkdtempSync,
  readdirSync,
  readFileSync,
  rmSync,
  writeFileSync,
} from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { deflateRawSync, inflateRawSync } from "node:zlib";
import { build } from "esbuild";

const web = dirname(fileURLToPath(import.meta.url));
const root = dirname(web);
const isCheck = process.argv.includes("--check");
const isScripts = process.argv.includes("--scripts");
const out = isCheck ? mkdtempSync(join(tmpdir(), "chaic-web-")) : join(root, "crates/eval/chaic-page/bundle");
const module = "chaic_web.wasm.deflate";
const pages = ["page", "study"];
const target = process.env.CARGO_TARGET_DIR ?? join(root, "target");
mkdirSync(out, { recursive: true });

const run = (program, args, env = {}) =>
  execFileSync(program, args, { cwd: root, stdio: "inherit", env: { ...process.env, ...env } });

/** Builds the module and its glue. */
function buildModule() {
  // The module does not depend on the folder in which it is built.
  const flags = ["-Ctarget-feature=+simd128", `--remap-path-prefix=${root}=`];
  const home = process.env.CARGO_HOME ?? join(process.env.HOME ?? "", ".cargo");
  flags.push(`--remap-path-prefix=${home}=`);
  const registry = join(home, "registry/src");
  for (const index of existsSync(registry) ? readdirSync(registry) : []) {
    flags.push(`--remap-path-prefix=${join(registry, index)}=`);
  }
  const triple = "wasm32-unknown-unknown";
  run("cargo", ["build", "--locked", "--profile", "web", "--target", triple, "-p", "chaic-web"], {
    CARGO_ENCODED_RUSTFLAGS: flags.join("\u001f"),
  });
  const wasm = join(target, triple, "web/chaic_web.wasm");
  run("wasm-bindgen", ["--target", "web", "--no-typescript", "--out-dir", join(web, "pkg"), wasm]);
  const bytes = readFileSync(join(web, "pkg/chaic_web_bg.wasm"));
  writeFileSync(join(out, module), deflateRawSync(bytes, { level: 9 }));
}

if (!isScripts) buildModule();

const options = {
  absWorkingDir: web,
  bundle: true,
  format: "iife",
  legalComments: "eof",
  minify: true,
  target: "es2022",
  // The glue loads the module from an address only if it gets no bytes.
  define: { "import.meta.url": '""' },
};
const scripts = isScripts ? pages : ["worker", ...pages];
for (const name of scripts) {
  await build({ ...options, entryPoints: [`src/${name}.ts`], outfile: join(out, `${name}.js`) });
}

if (isCheck) {
  const files = scripts.map((name) => `${name}.js`);
  for (const name of isScripts ? files : [...files, module]) {
    const [built, committed] = [out, join(root, "crates/eval/chaic-page/bundle")].map((folder) => {
      const content = readFileSync(join(folder, name));
      // Versions of Node compress differently.
      return name === module ? inflateRawSync(content) : content;
    });
    if (!built.equals(committed)) {
      console.error(`${name} differs from the committed file; run \`npm run build\` in web/`);
      process.exitCode = 1;
    }
  }
  rmSync(out, { recursive: true });
}
