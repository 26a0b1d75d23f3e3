# SPDX-License-Identifier: Apache-2.0
"""A certificate that is renewed while the coordinator runs."""
import hashlib
import http.client
import os
import signal
import ssl

import farm
import pytest
from test_tokens import add, bearer, penumbra


def fingerprint(service):
    """Of the certificate that a new connection is shown."""
    text = ssl.get_server_certificate(("127.0.0.1", service.http_port), timeout=10)
    return hashlib.sha256(ssl.PEM_cert_to_DER_cert(text)).hexdigest()


def fingerprint_of(path):
    return hashlib.sha256(ssl.PEM_cert_to_DER_cert(path.read_text())).hexdigest()


def replace(source, data):
    for name in ("cert.pem", "key.pem"):
        os.replace(source / name, data / name)


@pytest.fixture
def service(tmp_path):
    data = tmp_path / "data"
    penumbra("cert", "localhost", "127.0.0.1", "old.example", "--data", data)
    penumbra("cert", "localhost", "127.0.0.1", "new.example", "--data", tmp_path / "new")
    with farm.Farm(0, "--tls-cert", data / "cert.pem", "--tls-key", data / "key.pem", data=data,
                   tls=data / "cert.pem") as running:
        running.token, running.new = add(data, "a", "read"), tmp_path / "new"
        yield running


def status(service, host):
    return service.request("GET", "/livez", headers={"Host": host}).status


def test_a_new_certificate_is_shown_and_connections_go_on(service):
    """Broken by a certificate that is read at the start alone, by names that stay those of the old
    one, by connections that are closed for it."""
    expected = fingerprint_of(service.new / "cert.pem")
    assert fingerprint(service) != expected
    assert (status(service, "old.example"), status(service, "new.example")) == (200, 421)
    connection = service.connection()
    connection.request("GET", "/livez")
    connection.getresponse().read()
    socket = connection.sock
    replace(service.new, service.data)
    assert fingerprint(service) != expected
    service.server.send_signal(signal.SIGHUP)
    farm.wait_for(lambda: fingerprint(service) == expected, 5, "the new certificate")
    assert (status(service, "old.example"), status(service, "new.example")) == (421, 200)
    connection.request("GET", "/livez")
    assert connection.getresponse().status == 200 and connection.sock is socket
    connection.close()


@pytest.mark.parametrize("fault", ["no key", "other key", "nonsense", "readable", "missing"])
def test_a_broken_certificate_leaves_the_old_one(service, fault):
    """Broken by a service that ends, or shows nothing, because a file was half written."""
    before = fingerprint(service)
    cert, key = service.data / "cert.pem", service.data / "key.pem"
    context = ssl.create_default_context(cafile=cert)
    if fault == "no key":
        key.write_text("")
    elif fault == "other key":
        os.replace(service.new / "key.pem", key)
    elif fault == "nonsense":
        cert.write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
    elif fault == "readable":
        os.chmod(key, 0o644)
    else:
        cert.unlink()
    service.server.send_signal(signal.SIGHUP)
    farm.wait_for(lambda: "the certificate stays as it was" in service.log.read_text(), 5, "a complaint")
    assert fingerprint(service) == before
    connection = http.client.HTTPSConnection("127.0.0.1", service.http_port, timeout=10, context=context)
    connection.request("GET", "/v1/farm", headers=bearer(service.token))
    assert connection.getresponse().status in (200, 401)  # the token may not have been seen yet
    connection.close()


def test_without_a_certificate_a_hangup_ends_it(tmp_path):
    """Broken by a coordinator that outlives the terminal it was started in."""
    with farm.Farm(0, data=tmp_path / "data") as service:
        service.server.send_signal(signal.SIGHUP)
        assert service.server.wait(timeout=10) == -signal.SIGHUP
        service.server = None
