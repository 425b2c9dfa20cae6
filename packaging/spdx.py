#!/usr/bin/env python3
"""Writes an SPDX 2.3 document (JSON) of Ipminmax and what it is linked with, from the tables of SECURITY.md and
core/version.h.

    packaging/spdx.py > ipminmax.spdx.json
"""
import datetime
import json
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def dependencies():
    """Name, version and licence of each row of "What is linked"; names and licences of a row are separated by commas."""
    text = (ROOT / "SECURITY.md").read_text(encoding="utf-8").split("## What is linked")[1]
    for row in re.findall(r"^\| (?!library|---)(.*) \|$", text, re.MULTILINE):
        name, version, licence, purpose = (cell.strip() for cell in row.split(" | "))
        yield name, version, " AND ".join(part.split(" (")[0].strip() for part in licence.split(", ")), purpose


def package(identifier, name, version, licence, comment):
    return {"SPDXID": f"SPDXRef-{identifier}", "name": name, "versionInfo": version, "downloadLocation": "NOASSERTION",
            "filesAnalyzed": False, "licenseConcluded": "NOASSERTION", "licenseDeclared": licence,
            "copyrightText": "NOASSERTION", "comment": comment}


def document():
    version = re.search(r'IPMINMAX_VERSION "(.*)"', (ROOT / "core/version.h").read_text(encoding="ascii")).group(1)
    commit = subprocess.run(["git", "-C", ROOT, "log", "-1", "--format=%H %ct"], capture_output=True, text=True, check=False)
    sha, seconds = commit.stdout.split() if commit.returncode == 0 else ("unknown", "0")
    created = datetime.datetime.fromtimestamp(int(seconds), datetime.timezone.utc)  # the same bits for the same commit
    packages = [package("ipminmax", "ipminmax", version, "BSD-3-Clause", f"commit {sha}")]
    relations = [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                  "relatedSpdxElement": "SPDXRef-ipminmax"}]
    for name, tried, licence, purpose in dependencies():
        identifier = re.sub(r"[^A-Za-z0-9]+", "-", name)
        packages.append(package(identifier, name, tried, licence, purpose))
        relations.append({"spdxElementId": "SPDXRef-ipminmax", "relationshipType": "DEPENDS_ON",
                          "relatedSpdxElement": f"SPDXRef-{identifier}"})
    others = sorted({word for each in packages for word in each["licenseDeclared"].split() if word.startswith("LicenseRef-")})
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"ipminmax-{version}",
            "documentNamespace": f"https://spdx.org/spdxdocs/ipminmax-{version}-{sha}",
            "creationInfo": {"created": created.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: packaging/spdx.py"]},
            "hasExtractedLicensingInfos": [{"licenseId": name, "extractedText": f"The licence of {name.removeprefix('LicenseRef-')}, "
                                            "which its owner gives."} for name in others],
            "packages": packages, "relationships": relations}


if __name__ == "__main__":
    print(json.dumps(document(), indent=2))
