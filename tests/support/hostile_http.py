# SPDX-License-Identifier: Apache-2.0
"""Requests that no honest client sends, and what each may be answered with.

CASES: name -> (bytes, answers), where answers is a list of alternatives, each the statuses that come
back on the connection in order, after which the client has nothing to add: "" is a connection closed without a word, "400" one refusal, "200 200" two answers, "waits" a
server that waits for the rest, which it does until a deadline. More answers than requests mean that
something inside a body was taken for one.

libmicrohttpd 0.9.75 reads names and values up to their first NUL: "5\\0" is a length of 5.
"""
import random

HOST = b"Host: localhost\r\n"
LIVE = b"GET /livez HTTP/1.1\r\n" + HOST + b"\r\n"
IMAGE = b"/v1/renders/done/image.png"
SILENT = ["", "400", "waits"]  # what is no request need not be answered
CASES = {}


def case(name, data, *answers):
    assert name not in CASES, name
    CASES[name] = (data, list(answers))


def get(path=b"/livez", fields=b"", version=b"HTTP/1.1", method=b"GET", host=HOST):
    return method + b" " + path + b" " + version + b"\r\n" + host + fields + b"\r\n"


def post(fields=b"", body=b"", path=b"/v1/renders", method=b"POST"):
    return method + b" " + path + b" HTTP/1.1\r\n" + HOST + fields + b"\r\n" + body


def each(kind, items, make, *answers):
    for item in items:
        label = item[:40].decode("latin-1").encode("unicode_escape").decode()
        case(f"{kind} {len(CASES)} {label}", make(item), *answers)


def request_lines():
    each("other protocol", [
        b"\x16\x03\x01\x00\xa5\x01\x00\x00\xa1\x03\x03" + bytes(160), b"SSH-2.0-OpenSSH_9.2\r\n",
        b"EHLO example.org\r\n", b"*1\r\n$4\r\nPING\r\n", b"stats\r\n", bytes(1000), b"\xff" * 1000,
        b"PROXY TCP4 1.2.3.4 5.6.7.8 1 2\r\n" + LIVE,
        b"\r\n\r\n\0\r\nQUIT\n\x21\x11\0\x0c" + bytes(12) + LIVE, b"\0" + LIVE,
        b"\x80\x2e\x01\x00\x02", b"GIOP\x01\x00", b"{}\n", b"<x/>\r\n\r\n"],
        lambda data: data, "", "400", "501", "505", "waits")
    case("preface of HTTP/2", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0", "", "400", "505")
    each("no request", [b"", b"\r\n", b"\n", b"\r\n" * 3, b"G", b"GET", b"GET ", b"GET /livez",
                        b"GET /livez HTTP/1.1", b"GET /livez HTTP/1.1\r\n",
                        b"GET /livez HTTP/1.1\r\nHost: localhost\r\n"], lambda data: data, *SILENT)
    each("line without version", [b"GET /livez\r\n\r\n", b"GET\r\n\r\n", b"/livez\r\n\r\n", b" \r\n\r\n",
                                  b"GET  \r\n\r\n"], lambda data: data, "", "400", "505")
    each("version", [b"HTTP/0.9", b"HTTP/2.0", b"HTTP/3", b"HTTP/1", b"HTTP/1.", b"HTTP/1.11",
                     b"http/1.1", b"HTTP/ 1.1", b"HTTP/1.1x", b"HTTP/-1.1", b"HTTPS/1.1", b"ICY/1.1",
                     b"HTTP/99999999999.1", b"HTTP/1.1 HTTP/1.1", b"\0", b"HTTP/1\0.1"],
         lambda version: get(version=version), "", "400", "505", "404", "200")
    each("method", [b"get", b"GeT", b"FOO", b"TRACE", b"TRACK", b"CONNECT", b"PROPFIND", b"M-SEARCH",
                    b"DEBUG", b"PURGE", b"LINK", b"X" * 1000, b"GET/", b"G\tET", b"\xc3\x9c", b"(GET)",
                    b"\"GET\"", b"0"],
         lambda method: get(method=method), "405", "400", "501", "")
    case("method and NUL", get(method=b"GET\0"), "200", "400", "")
    each("method that is too long", [b"X" * 33000, b"\0" * 33000],
         lambda method: get(method=method), "", "400", "413", "414", "431")
    each("spaces", [b"GET  /livez HTTP/1.1", b"GET\t/livez\tHTTP/1.1", b" GET /livez HTTP/1.1",
                    b"GET /livez  HTTP/1.1", b"GET /livez HTTP/1.1 ", b"GET\x0b/livez HTTP/1.1",
                    b"GET /li vez HTTP/1.1", b"GET\r/livez HTTP/1.1"],
         lambda line: line + b"\r\n" + HOST + b"\r\n", "", "200", "400", "404", "405", "501", "505")
    each("line end", [b"\n", b"\r", b"\n\r", b"\r\r\n", b"\x85", b"\x0b", b"\0\r\n"],
         lambda end: b"GET /livez HTTP/1.1" + end + b"Host: localhost" + end + end,
         "", "200", "400", "505", "waits")
    case("hundred empty lines", b"\r\n" * 100 + LIVE, "200", "", "400")


def targets():
    for name, target in {"own": b"http://localhost/livez", "foreign": b"http://example.org/livez",
                         "https": b"https://localhost/livez", "ftp": b"ftp://localhost/livez",
                         "user": b"http://a@localhost/livez", "javascript": b"javascript:alert(1)",
                         "two slashes": b"//livez", "host after slashes": b"//example.org/livez",
                         "star": b"*", "authority": b"localhost:80", "relative": b"livez",
                         "file": b"file:///etc/passwd", "data": b"data:,x", "colon": b":",
                         "question": b"?", "hash": b"#", "backslash": b"\\livez"}.items():
        case(f"target: {name}", get(target), "404", "400", "200")
    each("path", [b"/../livez", b"/./livez", b"/v1/../livez", b"/v1/renders/../../../etc/passwd",
                  b"/web/../../etc/passwd", b"/web/..%2f..%2fetc/passwd", b"/web/%2e%2e/main.c",
                  b"/web/%252e%252e/x", b"/%2e%2e/%2e%2e/etc/passwd", b"/livez%00", b"/livez%00.png",
                  b"/web/app.js%00", b"/%00", b"/livez%", b"/livez%2", b"/livez%zz", b"/%c0%af",
                  b"/%e0%80%af", b"/%f8%80%80%80%af", b"/%ff%fe", b"/%u002flivez", b"/livez/", b"/livez;",
                  b"/livez;a=b", b"/livez\\", b"/livez\xff", b"/livez\xc3\xa4", b"/livez\x7f",
                  b"/livez\x01", b"/livez\x1b[31m", b"/v1/renders/%2e%2e", b"/v1/renders/%0d%0aX:y",
                  b"/v1/renders/" + b"x" * 10000, b"/" + b"%41" * 4000, b"/" + b"a/" * 5000,
                  b"/v1/renders/done%2fimage.png%3f", b"/v1/renders/done/iiif/" + b"9" * 60 + b"/1/1/d.png",
                  b"/v1/renders/done/iiif/full/max/0/default.png/..", b"/v1/renders/done/frames/-1.png",
                  b"/v1/renders/done/frames/4294967296.png", b"/v1/renders/done/frames/1e1.png",
                  b"/v1/renders/done/frames/%31.png%00", b"/v1/assets/sha256/..%2f..%2fpenumbra.db",
                  b"/v1/assets/sha256/" + b"0" * 63, b"/v1/assets/sha256/" + b"A" * 64,
                  b"/v1/scenes/sha256/%2e%2e"], get, "404", "400", "405", "200")
    each("path that is too long", [b"/" + b"x" * 17000, b"/" + b"%41" * 6000],
         get, "", "400", "413", "414", "431")
    each("query", [b"&" * 1000, b"=", b"=&=&=", b"a=%00", b"a=%", b"a=%zz", b"%00", b"a" * 10000, b"?" * 100,
                   b"&".join(b"a%d=1" % i for i in range(500)), b"limit=-1", b"limit=99999999999999999999",
                   b"limit=1e9", b"limit=%20 1"[:9], b"limit=0x10", b"limit=5%00", b"state=%00done",
                   b"state=done&state=queued", b"before=" + b"x" * 5000, b"before=%ff"],
         lambda query: get(b"/v1/renders?" + query), "200", "400", "", "waits")
    case("query of many", get(b"/livez?" + b"&" * 30000), "", "waits", "200", "400", "413", "414", "431")


def fields():
    each("field", [b"A", b": b", b":", b"A b: c", b" A: b", b"\tA: b", b"A\0: b", b"A: b\0c", b"\0: x",
                   b"A: b\x01", b"A: \x7f", b"A\xff: b", b"A: \xff\xfe", b"(A): b", b"A\r: b", b"A: b\rC: d",
                   b"A: b\r\n c", b"A: b\r\n\tc\r\n\td", b"A: b\nC: d", b"A" * 10000 + b": b", b"A: " + b"b" * 10000,
                   b"A:" + b" " * 10000, b"A:\t\t", b"A::::", b"A=b", b"A: b\r\n: c", b"{}: {}", b"@: @",
                   b"Cookie: " + b"a=b; " * 1000, b"Cookie: a\0=b", b"Cookie: ;;;=", b"Cookie: a=\"b",
                   b"Connection: keep-alive, close, x" + b",y" * 1000, b"Connection: Host",
                   b"Connection: \0", b"Keep-Alive: timeout=99999999999", b"Upgrade: websocket",
                   b"Upgrade: h2c\r\nConnection: Upgrade, HTTP2-Settings\r\nHTTP2-Settings: AAMAAABk",
                   b"Sec-WebSocket-Key: x\r\nUpgrade: websocket\r\nConnection: upgrade",
                   b"Expect: nothing", b"Expect: 100-continue, 100-continue", b"Max-Forwards: 0",
                   b"X-Forwarded-For: \r\n\r\n", b"X-Original-URL: /v1/farm", b"X-HTTP-Method-Override: DELETE",
                   b"Content-Length: 0", b"Date: " + b"9" * 500, b"Via: " + b"1.1 x, " * 2000,
                   b"Accept: " + b"*/*;q=0.1," * 1000, b"Accept: ;;;q=", b"Accept: a/b;q=-1", b"Accept: \0",
                   b"Authorization: Bearer", b"Authorization: Bearer " + b"A" * 10000,
                   b"Authorization: Basic AAAA", b"Authorization: \0", b"Prefer: wait", b"Prefer: wait=-1",
                   b"Prefer: wait=99999999999999999999", b"Prefer: wait=0x10", b"Prefer: " + b"wait=0," * 2000,
                   b"If-None-Match: " + b'"x",' * 4000, b"If-None-Match: W/", b'If-None-Match: "',
                   b"If-None-Match: *, *", b"Last-Event-ID: -1", b"Origin: null", b"Origin: x://y",
                   b"Accept-Encoding: " + b"gzip;q=1," * 1000, b"TE: trailers, deflate;q=0.5"],
         lambda field: get(fields=field + b"\r\n"), "200", "400", "", "406", "200 400")
    case("five thousand fields", get(fields=b"A: b\r\n" * 5000), "", "400", "413", "431")
    case("field that is too long", get(fields=b"A: " + b"b" * 17000 + b"\r\n"), "", "400", "413", "431")
    case("name that is too long", get(fields=b"A" * 17000 + b": b\r\n"), "", "400", "413", "431")
    case("field that never ends", b"GET / HTTP/1.1\r\n" + HOST + b"A: " + b"b" * 1000000, "", "400", "413", "431")
    each("host", [b"Host: \r\n", b"Host:\r\n", b"Host: example.org\r\n", b"Host: localhost.example.org\r\n",
                  b"Host: example.org#localhost\r\n", b"Host: localhost@example.org\r\n",
                  b"Host: example.org, localhost\r\n", b"Host: [::1\r\n", b"Host: ::1]\r\n", b"Host: [::1]x\r\n",
                  b"Host: 127.0.0.1.example.org\r\n", b"Host: 0x7f.1\r\n", b"Host: 2130706433\r\n",
                  b"Host: local\0host\r\n", b"Host: " + b"a" * 5000 + b"\r\n", b"Host: localhost/x\r\n",
                  b"Host: *\r\n", b"Host: \xff\r\n", b"Host: http://localhost\r\n", b"Host: local host\r\n",
                  b"Host : localhost\r\n", b"XHost: localhost\r\n", b""],
         lambda host: get(host=host), "421", "400", "")
    each("host with a port", [b"Host: localhost:\r\n", b"Host: localhost:0\r\n", b"Host: localhost:99999\r\n",
                              b"Host: localhost:80:80\r\n", b"Host: localhost:x\r\n", b"Host: localhost:-1\r\n",
                              b"Host: LOCALHOST\r\n", b"Host: localhost.\r\n", b"Host:localhost\r\n",
                              b"Host: \t localhost \t\r\n"],
         lambda host: get(host=host), "200", "400", "421")
    each("two hosts", [HOST + HOST, HOST + b"Host: example.org\r\n", b"Host: example.org\r\n" + HOST],
         lambda host: get(host=host), "400")
    case("no host, HTTP/1.0", get(version=b"HTTP/1.0", host=b""), "400")


SMUGGLED = b"GET /smuggled HTTP/1.1\r\n" + HOST + b"\r\n"


def lengths():
    each("length", [b"-1", b"+5", b"0x5", b"5,5", b"5, 5", b"5 5", b"", b" ", b"1e3", b"5.0", b"5;", b"\"5\"",
                    b"\x0b5", b"five", b"-0", b"9223372036854775808", b"18446744073709551615",
                    b"18446744073709551616", b"18446744073709551621", b"9" * 100, b"9" * 10000, b"5_0",
                    b"\xd9\xa5"],
         lambda value: post(b"Content-Length: " + value + b"\r\n", b"{   }" + SMUGGLED), "400", "413", "")
    each("length with zeros", [b"005", b"5 ", b"\t5", b"0" * 100 + b"5"],
         lambda value: post(b"Content-Length: " + value + b"\r\n", b"{   }" + LIVE), "400 200", "400", "")
    case("length and NUL", post(b"Content-Length: 5\0\r\n", b"{   }" + SMUGGLED), "400", "400 404")
    case("coding and NUL", post(b"Transfer-Encoding: chunked\0\r\n", b"0\r\n\r\n" + SMUGGLED), "400", "400 404")
    for name, value in {"same": b"5", "longer": b"50", "shorter": b"0", "not a number": b"x", "empty": b""}.items():
        two = b"Content-Length: 5\r\nContent-Length: " + value + b"\r\n"
        case(f"two lengths: {name}", post(two, b"{   }" + SMUGGLED), "400")
        two = b"Content-Length: " + value + b"\r\nContent-Length: 5\r\n"
        case(f"two lengths: {name} first", post(two, b"{   }" + SMUGGLED), "400")
    for name, bad in {"cl, te": b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n",
                      "te, cl": b"Transfer-Encoding: chunked\r\nContent-Length: 5\r\n",
                      "cl 0, te": b"Content-Length: 0\r\nTransfer-Encoding: chunked\r\n",
                      "cl, te, cl": b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\nContent-Length: 5\r\n",
                      "cl, other te": b"Content-Length: 5\r\nTransfer-Encoding: identity\r\n"}.items():
        case(f"both: {name}", post(bad, b"0\r\n\r\n" + SMUGGLED), "400", "501")
        case(f"both: {name}, GET", get(fields=bad) + b"0\r\n\r\n" + SMUGGLED, "400", "501")
        case(f"both: {name}, HTTP/1.0",
             get(b"/v1/renders", bad, b"HTTP/1.0", b"POST") + b"0\r\n\r\n" + SMUGGLED, "400", "501")
    each("coding", [b"identity", b"gzip", b"gzip, chunked", b"chunked, chunked", b"chunked, identity", b"xchunked",
                    b"chunkedx", b"chunked;q=1", b"\"chunked\"", b"\x0bchunked", b"chunked,",
                    b",chunked", b"", b"chun\r\n ked", b"\xd0\xa1hunked", b"cow", b"chunked chunked", b"chunked\x0c"],
         lambda value: post(b"Transfer-Encoding: " + value + b"\r\n", b"0\r\n\r\n" + SMUGGLED), "400", "501", "")
    each("coding spelt oddly", [b"Transfer-Encoding: Chunked\r\n", b"transfer-encoding:chunked\r\n",
                                b"Transfer-Encoding:\tchunked \r\n", b"Transfer-Encoding: \r\n chunked\r\n"],
         lambda field: post(field, b"5\r\n{   }\r\n0\r\n\r\n" + LIVE), "400 200", "400", "501", "")
    each("field like a coding", [b"Transfer-Encoding : chunked\r\n", b" Transfer-Encoding: chunked\r\n",
                                 b"X: y\nTransfer-Encoding: chunked\r\n", b"Transfer_Encoding: chunked\r\n",
                                 b"Transfer-Encoding\0: chunked\r\n", b"X: y\rTransfer-Encoding: chunked\r\n",
                                 b"Transfer-Encoding: chunked\r\nTransfer-Encoding: identity\r\n",
                                 b"Transfer-Encoding: identity\r\nTransfer-Encoding: chunked\r\n",
                                 b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n"],
         lambda field: post(b"Content-Length: 5\r\n" + field, b"0\r\n\r\n" + SMUGGLED), "400", "501", "400 404", "")
    each("body of a GET", [b"Content-Length: %d\r\n\r\n" % len(SMUGGLED) + SMUGGLED,
                           b"Transfer-Encoding: chunked\r\n\r\n%x\r\n" % len(SMUGGLED) + SMUGGLED + b"\r\n0\r\n\r\n"],
         lambda rest: get()[:-2] + rest, "200", "400")
    case("length of a body that does not come", post(b"Content-Length: 1000\r\n", b"{}"), "waits")
    case("length of 8 MiB and no body", post(b"Content-Length: 8388608\r\n"), "waits")
    case("length of a body that is too large", post(b"Content-Length: 99999999\r\n", b"{}"), "413")
    case("no length", post(b"", b"{}"), "400", "400 400")


def chunks():
    chunked = b"Transfer-Encoding: chunked\r\n"
    each("chunk size", [b"zz", b"-1", b"+5", b"0x5", b" 5", b"", b"5\0", b"5 5", b"g", b"5,", b"\xff", b"5.0",
                        b"fffffffffffffffff", b"ffffffffffffffff", b"8000000000000000", b"1" + b"0" * 30,
                        b"5\r", b"5\t5", b"\t5", b"_5", b"5h"],
         lambda size: post(chunked, size + b"\r\n{   }\r\n0\r\n\r\n" + SMUGGLED), "400", "413", "", "waits")
    each("chunk size spelt oddly", [b"5;a=b", b"5;", b"5;" + b"a" * 1000, b"00005", b"5;a=\"b\"", b"0" * 15 + b"5",
                                    b"5 ", b"5 ;a"],
         lambda size: post(chunked, size + b"\r\n{   }\r\n0\r\n\r\n" + LIVE), "400 200", "400", "")
    each("chunk", [b"5\r\n{   }0\r\n\r\n", b"5\r\n{   }XX0\r\n\r\n", b"5\r\n{   }\n0\r\n\r\n", b"5\n{   }\r\n0\r\n\r\n",
                   b"5\r{   }\r\n0\r\n\r\n", b"5\r\n{  }\r\n0\r\n\r\n", b"5\r\n{     }\r\n0\r\n\r\n", b"5\r\n{   }\r\n",
                   b"5\r\n{   }\r\n0", b"5\r\n{   }\r\n0\r\n", b"0\r\n", b"0", b"\r\n", b"", b"5", b"5\r\n{",
                   b"5;" + b"a" * 40000 + b"\r\n{   }\r\n0\r\n\r\n", b"0" * 40000 + b"5\r\n{   }\r\n0\r\n\r\n",
                   b"1\r\n{\r\n" * 2000, b"\0" * 100],
         lambda body: post(chunked, body), "400", "", "413", "waits")
    each("trailer", [b"A: b\r\n", b"Content-Length: 5\r\n", b"Transfer-Encoding: chunked\r\n", b"Host: example.org\r\n",
                     b"A\r\n", b": b\r\n", b"\0: b\r\n", b"A: b\r\n c\r\n", b"A: " + b"b" * 10000 + b"\r\n",
                     b"A: b\r\n" * 1000],
         lambda trailer: post(chunked, b"5\r\n{   }\r\n0\r\n" + trailer + b"\r\n"), "400", "", "413", "431")
    case("trailer that is too long", post(chunked, b"5\r\n{   }\r\n0\r\nA: " + b"b" * 50000 + b"\r\n\r\n"),
         "400", "", "413", "431")
    case("chunks, 1 byte each, good", post(chunked, b"1\r\n{\r\n" + b"1\r\n \r\n" * 500 + b"1\r\n}\r\n0\r\n\r\n"), "400")
    case("chunks of 9 MiB", post(chunked, (b"100000\r\n" + b" " * (1 << 20) + b"\r\n") * 9 + b"0\r\n\r\n"), "413")
    case("chunks in HTTP/1.0", get(b"/v1/renders", chunked, b"HTTP/1.0", b"POST") + b"5\r\n{   }\r\n0\r\n\r\n",
         "400", "501", "")


def pipelines():
    for count in (2, 3, 20, 200):
        case(f"{count} at once", LIVE * count, " ".join(["200"] * count))
    case("heads", get(method=b"HEAD") * 5 + LIVE, " ".join(["200"] * 6))
    case("not modified", get(b"/v1/renders/done", b"If-None-Match: *\r\n") + LIVE, "200 200", "304 200")
    case("good, bad, good", LIVE + b"\0\0\0\r\n\r\n" + LIVE, "200", "200 400", "200 200")
    case("after close", get(fields=b"Connection: close\r\n") + SMUGGLED, "200")
    case("after HTTP/1.0", get(version=b"HTTP/1.0") + SMUGGLED, "200")
    case("after a refusal", post(b"Content-Length: 99999999\r\n") + SMUGGLED, "413")
    case("bodies", post(b"Content-Length: 5\r\n", b"{   }") * 20, " ".join(["400"] * 20))
    case("body that is a request", post(b"Content-Length: %d\r\n" % len(SMUGGLED), SMUGGLED) + LIVE, "400 200")
    case("expectation", post(b"Content-Length: 5\r\nExpect: 100-continue\r\n", b"{   }") + LIVE,
         "100 400 200", "400 200")
    case("half a second one", LIVE + b"GET /liv", "200", "200 400")
    case("images", get(IMAGE) * 10, " ".join(["200"] * 10))
    case("deletes", get(b"/v1/renders/nothing", method=b"DELETE") * 10, " ".join(["404"] * 10))
    case("options", get(b"/v1/renders", method=b"OPTIONS") * 10, " ".join(["204"] * 10))


def contents():
    each("range", [b"bytes=", b"bytes", b"bytes=-", b"bytes=a-b", b"bytes=5", b"bytes=9-1", b"bytes=-0",
                   b"bytes=--1", b"bytes=1--", b"bytes= 0-1", b"bytes=0 -1", b"bytes=0-1,", b"bytes=,", b"bytes=,,,,0-1",
                   b"lines=0-1", b"bytes:0-1", b"BYTES=0-1", b"bytes=0x0-0x1", b"bytes=1e1-2e1", b"bytes=\0-1",
                   b"bytes=99999999999999999999-", b"bytes=0-99999999999999999999", b"bytes=-99999999999999999999",
                   b"bytes=18446744073709551615-18446744073709551616", b"bytes=0-0,-1", b"bytes=0-,0-,0-",
                   b"bytes=" + b",".join(b"0-%d" % i for i in range(1300)), b"bytes=" + b"0-0," * 2000 + b"0-0",
                   b"bytes=+0-1", b"bytes=0-+1", b"bytes=000000-1", b"none"],
         lambda value: get(IMAGE, b"Range: " + value + b"\r\n"), "200", "206", "416", "400", "")
    case("two ranges", get(IMAGE, b"Range: bytes=0-1\r\nRange: bytes=2-3\r\n"), "200", "206", "400")
    case("range if", get(IMAGE, b'Range: bytes=0-1\r\nIf-Range: "x"\r\n'), "200")
    case("range if weak", get(IMAGE, b"Range: bytes=0-1\r\nIf-Range: W/\r\n"), "200")
    each("content coding", [b"gzip", b"deflate", b"br", b"zstd", b"identity", b"compress", b"gzip, gzip, gzip", b"x",
                            b"", b"\0", b"chunked", b"gzip;q=1"],
         lambda value: post(b"Content-Length: 20\r\nContent-Encoding: " + value + b"\r\n",
                            b"\x1f\x8b\x08" + bytes(17)), "400", "415", "")
    each("content type", [b"application/json\0", b"application/json;" + b"a=b;" * 2000, b"application/json, text/json",
                          b"multipart/form-data; boundary=" + b"-" * 5000, b"multipart/form-data", b"/", b"", b"json",
                          b"application/json; charset=utf-7", b"application/json; charset=\"", b"text/html"],
         lambda value: post(b"Content-Length: 5\r\nContent-Type: " + value + b"\r\n", b"{   }"), "400", "415", "")
    each("body", [bytes(50), b"\xff" * 50, b"\xef\xbb\xbf{}" + bytes(45), b"[" * 50, b'{"a":' * 10, b'"' * 50, b"9" * 50,
                  b'{"version": 1, "version": 1}'.ljust(50), b"--x\r\nContent-Disposition: form-data\r\n\r\n".ljust(50)],
         lambda body: post(b"Content-Length: 50\r\n", body), "400")
    each("key", [b"", b"\"" * 3000, b"\0", b"x" * 10000, b"\xff", b" , "],
         lambda value: post(b"Content-Length: 5\r\nIdempotency-Key: " + value + b"\r\n", b"{   }"), "400", "")
    case("asset of another name", post(b"Content-Length: 5\r\n", b"hello", b"/v1/assets/sha256/" + b"0" * 64, b"PUT"),
         "422")
    case("asset of 2 GiB", post(b"Content-Length: 2147483648\r\n", b"", b"/v1/assets/sha256/" + b"0" * 64, b"PUT"), "413")
    case("missing of what is no list", post(b"Content-Length: 5\r\n", b"hello", b"/v1/assets/missing"), "400")


def noise(count):
    """Good requests with bytes changed at random, the same each time: anything but a 5xx of ours."""
    generator = random.Random(1)
    seeds = [LIVE, post(b"Content-Length: 5\r\n", b"{   }"), get(IMAGE, b"Range: bytes=0-9\r\n"),
             post(b"Transfer-Encoding: chunked\r\n", b"5\r\n{   }\r\n0\r\n\r\n")]
    for i in range(count):
        data = bytearray(seeds[i % len(seeds)])
        for _ in range(generator.randint(1, 6)):
            at = generator.randrange(len(data))
            data[at:at + generator.randint(0, 2)] = generator.randbytes(generator.randint(0, 2))
        case(f"noise {i}", bytes(data))


request_lines()
targets()
fields()
lengths()
chunks()
pipelines()
contents()
noise(60)
