// Bundles the scripts of both pages with three.js into the one script that such a page holds.
import { readFile } from 'node:fs/promises';
import { build } from 'esbuild';

const licence = await readFile('node_modules/three/LICENSE', 'utf8');
const { version } = JSON.parse(await readFile('node_modules/three/package.json', 'utf8'));

await build({
  entryPoints: { 'viewer.bundle': 'src/pages.js' },
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2020',
  // A page may be opened in whatever encoding; escapes hold in all of them.
  charset: 'ascii',
  legalComments: 'none',
  banner: { js: `/*! three.js ${version}, bundled here in parts.\n${licence.trim()}\n*/` },
  outdir: '../mocap_skel/report/page',
});
