#!/usr/bin/env bash
# The pages as one site in build/site, which needs no network and no server, with the reference of the public headers in
# build/site/api. A dead link, a page without a place in mkdocs.yml, a formula that KaTeX cannot read or a warning of
# Doxygen is an error. Formulas stay TeX if Debian's package libjs-katex is missing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
cmake/install_dependencies.sh mkdocs mkdocs-material doxygen
cmake/install_dependencies.sh libjs-katex || true
katex=/usr/share/javascript/katex

source=build/site_source
rm -rf "$source"
mkdir -p "$source"
cp -r docs "$source/docs"
rm "$source/docs/build_site.sh"
mkdir "$source/site"
mv "$source/docs/site/main.html" "$source/site"
sed 's|^site_dir:.*|site_dir: ../site|' mkdocs.yml > "$source/mkdocs.yml"
if [ -e "$katex/katex.min.js" ]; then
  mkdir -p "$source/docs/katex/contrib"
  cp "$katex"/katex.min.{js,css} "$source/docs/katex"
  cp "$katex/contrib/auto-render.js" "$source/docs/katex/contrib"
  cp -rL "$katex/fonts" "$source/docs/katex"
else
  echo "Formulas are not typeset: install the package libjs-katex ($katex) and build the site again" >&2
  sed -i -E '/^extra_javascript:/d; /katex.min.css/d' "$source/mkdocs.yml"
fi

# A block's first line may name its file (```cpp game.cpp), which the site shows as its title. Between the comments
# "tabs" and "end of tabs" each **title** on a line of its own begins a tab.
sed -E -i 's/^```(cpp|c|python) ([a-z_.]+)$/```\1 title="\2"/' "$source"/docs/*.md
awk 'BEGIN { print "---\nhide: [toc]\n---" }
     /^<!-- tabs -->$/ { tabs = 1; next }
     /^<!-- end of tabs -->$/ { tabs = 0; next }
     tabs && /^\*\*.*\*\*$/ { gsub(/\*\*/, ""); print "=== \"" $0 "\""; next }
     { print tabs && NF ? "    " $0 : $0 }' docs/index.md |
  sed -E 's/^( *)```(cpp|c|python) ([a-z_.]+)$/\1```\2/' > "$source/docs/index.md"
mkdocs build --quiet --clean --config-file "$source/mkdocs.yml"
(printf 'var __search = {index: Promise.resolve('; cat build/site/search/search_index.json; echo ')};') \
  > build/site/site/search_index.js

# The landing page has its tabs, and no page loads anything from the network.
grep -q 'class="tabbed-set' build/site/index.html
if grep -E '<(script|img|link rel="stylesheet")[^>]*(src|href)="https?:' build/site/*.html; then exit 1; fi

# Every formula must be one that KaTeX reads.
if [ -e "$katex/katex.min.js" ] && command -v node >/dev/null; then
  node - "$katex/katex.min.js" build/site/*.html <<'SCRIPT'
const [katex, ...pages] = process.argv.slice(2).map((path, i) => (i ? path : require(path)));
const text = (html) => html.replace(/&lt;/g, "<").replace(/&gt;/g, ">").replace(/&amp;/g, "&");
for (const page of pages) {
  const formulas = require("fs").readFileSync(page, "utf8").matchAll(/class="arithmatex">\\[[(]([^]*?)\\[\])]</g);
  for (const [, formula] of formulas) {
    try {
      katex.renderToString(text(formula));
    } catch (error) {
      console.error(`${page}: ${error.message}`);
      process.exitCode = 1;
    }
  }
}
SCRIPT
fi

doxygen - <<END
PROJECT_NAME = Ipminmax
OUTPUT_DIRECTORY = build/site
HTML_OUTPUT = api
GENERATE_LATEX = NO
INPUT = core adapter
FILE_PATTERNS = *.hpp *.h
EXCLUDE_PATTERNS = core/*/* adapter/*/*
RECURSIVE = NO
HAVE_DOT = NO
FULL_PATH_NAMES = NO
JAVADOC_AUTOBRIEF = YES
EXTRACT_ALL = YES
EXTRACT_LOCAL_CLASSES = NO
MARKDOWN_SUPPORT = YES
PREDEFINED = IPMINMAX_API=
QUIET = YES
WARN_AS_ERROR = FAIL_ON_WARNINGS
END
echo "build/site/index.html"
