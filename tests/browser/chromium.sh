#!/bin/sh
# Make sure that the browser tests have a Chromium; the argument is the project's Python.
set -eu
for name in chromium chromium-browser google-chrome; do
  if command -v "$name" >/dev/null && "$name" --version >/dev/null 2>&1; then exit 0; fi
done
if "$1" -c 'import pathlib, playwright.sync_api as p, sys
with p.sync_playwright() as w: sys.exit(not pathlib.Path(w.chromium.executable_path).exists())'; then
  exit 0
fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq chromium >/dev/null || true
  if command -v chromium >/dev/null && chromium --version >/dev/null 2>&1; then exit 0; fi
  # Ubuntu's package is an empty shell around a snap
  exec "$1" -m playwright install --with-deps chromium
fi
echo "The browser tests need Chromium. Install it with one of:" >&2
echo "  sudo apt install chromium" >&2
echo "  $1 -m playwright install chromium" >&2
exit 1
