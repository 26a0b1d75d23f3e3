# SPDX-License-Identifier: Apache-2.0
"""The bill of materials: what SPDX 2.3 requires of a document, and that it is true of the programs."""
import hashlib
import json
import re
import subprocess

import farm
import pytest

BUILD = farm.BIN.parent
PROGRAMS = ("penumbra", "penumbra-encoder", "penumbra-worker")
RELATIONS = {"DESCRIBES", "DYNAMIC_LINK", "DEPENDS_ON", "STATIC_LINK"}  # of those of clause 11.1 that are used
SPDX_ID = re.compile(r"SPDXRef-[A-Za-z0-9.-]+")


@pytest.fixture(scope="module")
def made():
    run = subprocess.run(["cmake", "--build", BUILD, "--target", "sbom"], capture_output=True, text=True, timeout=600)
    assert run.returncode == 0, run.stdout + run.stderr
    return (BUILD / "penumbra.spdx.json").read_bytes()


@pytest.fixture(scope="module")
def document(made):
    return json.loads(made)


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout


def test_the_document_has_what_the_specification_requires(document):
    """Breaks when a tool that reads SPDX would refuse the document (clauses 6 and 7)."""
    assert document["spdxVersion"] == "SPDX-2.3" and document["dataLicense"] == "CC0-1.0"
    assert document["SPDXID"] == "SPDXRef-DOCUMENT" and document["name"]
    assert re.fullmatch(r"https?://[^#\s]+", document["documentNamespace"])
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", document["creationInfo"]["created"])
    assert all(re.match(r"(Person|Organization): .|Tool: .+-.", who) for who in document["creationInfo"]["creators"])
    for package in document["packages"]:
        assert SPDX_ID.fullmatch(package["SPDXID"]), package
        assert package["name"] and package["versionInfo"] and package["downloadLocation"]
        # Then neither files nor a verification code of them may be there.
        assert package["filesAnalyzed"] is False and "packageVerificationCode" not in package
        assert re.match(r"(Person|Organization): .|NOASSERTION$", package["supplier"])
        for reference in package.get("externalRefs", []):
            assert reference["referenceCategory"] == "PACKAGE-MANAGER" and reference["referenceType"] == "purl"
            assert re.fullmatch(r"pkg:deb/debian/[a-z0-9.+-]+@[A-Za-z0-9.%-]+\?arch=\w+", reference["referenceLocator"])
    names = [package["SPDXID"] for package in document["packages"]]
    assert len(names) == len(set(names))


def test_relationships_are_between_what_is_there(document):
    names = {"SPDXRef-DOCUMENT", *(package["SPDXID"] for package in document["packages"])}
    related = set()
    for relation in document["relationships"]:
        assert relation["relationshipType"] in RELATIONS
        assert {relation["spdxElementId"], relation["relatedSpdxElement"]} <= names
        related |= {relation["spdxElementId"], relation["relatedSpdxElement"]}
    assert related == names
    described = {r["relatedSpdxElement"] for r in document["relationships"] if r["relationshipType"] == "DESCRIBES"}
    assert described == {f"SPDXRef-{name}" for name in PROGRAMS}


@pytest.mark.parametrize("name", PROGRAMS)
def test_it_is_of_these_programs(document, name):
    """Breaks when it tells of other programs, or leaves a library out that one asks for."""
    package = next(p for p in document["packages"] if p["name"] == name)
    content = (farm.BIN / name).read_bytes()
    assert {c["algorithm"]: c["checksumValue"] for c in package["checksums"]} == {
        "SHA1": hashlib.sha1(content).hexdigest(), "SHA256": hashlib.sha256(content).hexdigest()}
    linked = {r["relatedSpdxElement"].removeprefix("SPDXRef-deb-") for r in document["relationships"]
              if r["spdxElementId"] == f"SPDXRef-{name}" and r["relationshipType"] == "DYNAMIC_LINK"}
    for library in re.findall(r"\(NEEDED\).*\[(.+)\]", output("readelf", "-dW", farm.BIN / name)):
        owners = {line.split(":")[0].replace("+", "-plus") for line in output("dpkg-query", "-S", f"*/{library}").splitlines()}
        assert owners & linked, (library, owners, linked)


def test_versions_are_those_that_are_installed(document):
    packages = {p["name"]: p["versionInfo"] for p in document["packages"] if p["name"] not in PROGRAMS}
    found = output("dpkg-query", "-W", "-f", "${Package} ${Version}\n", *packages)
    assert dict(line.split() for line in found.splitlines()) == packages
    assert {"libtinygltf-dev", "nlohmann-json3-dev", "libembree3-3", "libopenexr-3-1-30", "libgnutls30"} <= set(packages)


def test_the_same_programs_give_the_same_bytes(made, tmp_path):
    """Breaks when it holds a time or a path of the machine, so that nobody could compare two."""
    version = json.loads(made)["packages"][0]["versionInfo"]
    again = tmp_path / "again.json"
    output("/usr/bin/python3", farm.ROOT / "deploy/sbom.py", version, again, *(farm.BIN / name for name in PROGRAMS))
    assert again.read_bytes() == made
    assert str(farm.ROOT).encode() not in made
