#!/usr/bin/env bash
# The pages as one site in build/site, with the reference of the public headers in build/site/api. A dead link, a page
# without a place in mkdocs.yml or a warning of Doxygen is an error.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
cmake/install_dependencies.sh mkdocs mkdocs-material doxygen

# A block's first line may name its file (```cpp game.cpp), which the site shows as its title.
source=build/site_source
rm -rf "$source"
mkdir -p "$source"
cp -r docs "$source/docs"
rm "$source/docs/build_site.sh"
sed 's|^site_dir:.*|site_dir: ../site|' mkdocs.yml > "$source/mkdocs.yml"
sed -E -i 's/^```(cpp|c|python) ([a-z_.]+)$/```\1 title="\2"/' "$source"/docs/*.md
mkdocs build --quiet --clean --config-file "$source/mkdocs.yml"

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
