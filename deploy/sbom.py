# SPDX-License-Identifier: Apache-2.0
"""The programs' bill of materials, SPDX 2.3 in JSON: sbom.py VERSION OUTPUT PROGRAM...

From the programs as they are: the Debian packages of all libraries that the loader finds for them, with their
versions here, and those whose headers alone are compiled in. The same programs and packages give the same
bytes; SOURCE_DATE_EPOCH sets the time, which is else that of the youngest program."""
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

HEADERS = ("libtinygltf-dev", "nlohmann-json3-dev")  # nothing of them shows in the programs
LINKED_BY_HEADERS = "penumbra-worker"


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, "LC_ALL": "C"}).stdout


def needed(program):
    """The names of the libraries that it asks for itself."""
    return set(re.findall(r"\(NEEDED\).*\[(.+)\]", run("readelf", "-dW", program)))


def loaded(program):
    """{name: file} of all libraries that are loaded with it."""
    text = run("ldd", program)
    assert "not found" not in text, text
    found = dict(re.findall(r"^\s*(\S+) => (/\S+) \(", text, flags=re.M))
    loader = re.search(r"^\s*(/\S+) \(", text, flags=re.M)
    return {**found, os.path.basename(loader[1]): loader[1]}


def owners(files):
    """{file: Debian package}; Debian lists files by their place before or after /lib became /usr/lib."""
    spellings = {}
    for file in files:
        for path in {file, os.path.realpath(file)}:
            for form in {path, path.removeprefix("/usr"), "/usr" + path.removeprefix("/usr")}:
                spellings[form] = file
    # It fails as soon as one spelling belongs to nobody.
    text = subprocess.run(["dpkg-query", "-S", *spellings], capture_output=True, text=True).stdout
    found = {}
    for line in text.splitlines():
        packages, _, path = line.rpartition(": ")
        if path in spellings:
            found[spellings[path]] = packages.split(", ")[0].split(":")[0]
    missing = set(files) - set(found)
    assert not missing, f"of no Debian package: {sorted(missing)}"
    return found


def debian(names):
    """{package: (version, architecture, source, homepage)}"""
    form = "${Package}\t${Version}\t${Architecture}\t${source:Package}\t${source:Version}\t${Homepage}\n"
    found = {}
    for line in run("dpkg-query", "-W", "-f", form, *sorted(names)).splitlines():
        name, *rest = line.split("\t")
        found[name] = rest
    assert not set(names) - set(found), sorted(set(names) - set(found))
    return found


def identifier(name):
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name.replace("+", "-plus"))


def debian_package(name, version, architecture, source, source_version, homepage):
    quoted = version.replace(":", "%3A").replace("+", "%2B").replace("~", "%7E")
    return {
        "SPDXID": identifier(f"deb-{name}"), "name": name, "versionInfo": version,
        "supplier": "Organization: Debian", "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
        "licenseConcluded": "NOASSERTION", "licenseDeclared": "NOASSERTION", "copyrightText": "NOASSERTION",
        "sourceInfo": f"Debian source package {source} {source_version}",
        **({"homepage": homepage} if homepage else {}),
        "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                          "referenceLocator": f"pkg:deb/debian/{name}@{quoted}?arch={architecture}"}]}


def own_package(program, version):
    content = program.read_bytes()
    return {
        "SPDXID": identifier(program.name), "name": program.name, "versionInfo": version,
        "packageFileName": program.name, "primaryPackagePurpose": "APPLICATION",
        "supplier": "Organization: Penumbra", "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
        "licenseConcluded": "Apache-2.0", "licenseDeclared": "Apache-2.0", "copyrightText": "NOASSERTION",
        "checksums": [{"algorithm": kind, "checksumValue": hashlib.new(kind.lower(), content).hexdigest()}
                      for kind in ("SHA1", "SHA256")]}


def relate(program, kind, packages):
    return [{"spdxElementId": identifier(program.name), "relationshipType": kind,
             "relatedSpdxElement": identifier(f"deb-{name}")} for name in sorted(packages)]


def relationships(programs, libraries, owner):
    found = []
    for program in programs:
        found.append({"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                      "relatedSpdxElement": identifier(program.name)})
        direct = {owner[libraries[program][name]] for name in needed(program)}
        everything = {owner[file] for file in libraries[program].values()}
        found += relate(program, "DYNAMIC_LINK", direct)
        found += relate(program, "DEPENDS_ON", everything - direct)
        if program.name == LINKED_BY_HEADERS:
            found += relate(program, "STATIC_LINK", HEADERS)
    return found


def document(version, programs):
    libraries = {program: loaded(program) for program in programs}
    owner = owners({file for found in libraries.values() for file in found.values()})
    packages = [own_package(program, version) for program in programs]
    packages += [debian_package(name, *rest) for name, rest in sorted(debian({*owner.values(), *HEADERS}).items())]
    time = os.environ.get("SOURCE_DATE_EPOCH") or max(int(program.stat().st_mtime) for program in programs)
    body = {"packages": packages, "relationships": relationships(programs, libraries, owner)}
    digest = hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
    created = datetime.datetime.fromtimestamp(int(time), datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
            "name": f"penumbra-{version}", "documentNamespace": f"https://penumbra.invalid/spdx/penumbra-{version}-{digest}",
            "creationInfo": {"created": created, "creators": ["Organization: Penumbra", f"Tool: sbom.py-{version}"]},
            **body}


def main(version, output, *programs):
    made = document(version, [pathlib.Path(program) for program in programs])
    pathlib.Path(output).write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")
    print(f"{output}: {len(made['packages'])} packages")


main(*sys.argv[1:])
