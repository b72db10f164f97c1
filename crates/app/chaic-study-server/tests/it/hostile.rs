//! Promises: requests of other sites, strangers and broken clients get a clear refusal, store nothing and read nothing;
//! sizes and rates are bounded.

use chaic_study_server::{ENTRY_RATE, MAX_BODY_BYTES, PARTICIPANT_RATE};

use crate::kit::{Answer, Client, DEFINITION, Folder, Server, code, lines};

/// Sends a request with these lines of headers after the first line.
fn send(server: &Server, line: &str, headers: &[&str]) -> Option<Answer> {
    let headers: String = headers.iter().map(|header| format!("{header}\r\n")).collect();
    server.raw(format!("{line} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n").as_bytes())
}

#[test]
fn the_page_has_a_strict_policy() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let host = format!("Host: {}", server.address);
    let page = send(&server, "GET /?PARTICIPANT=1", &[&host]).expect("an answer");
    assert_eq!(page.status, 200);
    assert!(page.body.contains("<chaic-study>"));
    for words in [
        "content-type: text/html; charset=utf-8",
        "x-content-type-options: nosniff",
        "cache-control: no-store",
        "referrer-policy: no-referrer",
        "default-src 'none'",
        "frame-ancestors 'none'",
        "connect-src 'self'",
        "script-src 'sha256-",
    ] {
        assert!(page.head.contains(words), "{words}: {}", page.head);
    }
    assert!(!page.head.contains("script-src 'unsafe-inline'") && !page.head.contains("set-cookie"));
    let proxied = send(&server, "GET /", &["Host: study.example.org"]).expect("an answer");
    assert_eq!(proxied.status, 200);
}

#[test]
fn other_hosts_and_origins_are_refused() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let Client { address, code, token } = server.client(1);
    let (host, origin) = (format!("Host: {address}"), format!("Origin: http://{address}"));
    let token = format!("Authorization: Bearer {token}");
    let enter = format!("PUT /participants/{code}");
    for (line, headers, words) in [
        ("GET /", vec!["Host: evil.example"], "not known under this name"),
        ("GET /", vec![], "not known under this name"),
        ("GET /", vec![&*host, &*host], "not known under this name"),
        ("GET http://evil.example/", vec![&*host], "not known under this name"),
        (&*enter, vec![&*host, &*token], "not come from the page"),
        (&*enter, vec![&*host, &*token, "Origin: http://evil.example"], "not come from the page"),
        (&*enter, vec![&*host, &*token, "Origin: null"], "not come from the page"),
        (&*enter, vec!["Host: evil.example", &*token, &*origin], "not known under this name"),
    ] {
        let answer = send(&server, line, &headers);
        let answer = answer.unwrap_or_else(|| panic!("no answer to {line} {headers:?}"));
        assert_eq!(answer.status, 403, "{line} {headers:?}");
        assert!(answer.error().contains(words), "{line} {headers:?}: {}", answer.error());
        assert!(answer.head.contains("nosniff"));
    }
    for token in
        ["", "Authorization: Bearer", "Authorization: Basic abc", "Authorization: Bearer 12"]
    {
        let headers = [&*host, &*origin, token];
        let headers: Vec<&str> = headers.into_iter().filter(|header| !header.is_empty()).collect();
        assert_eq!(send(&server, &enter, &headers).expect("an answer").status, 401, "{token}");
    }
    assert_eq!(folder.files(), [""; 0]);
    assert_eq!(send(&server, &enter, &[&host, &origin, &token]).expect("an answer").status, 201);
}

#[test]
fn strangers_cannot_read_change_or_delete() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let client = server.client(1);
    client.slot();
    let text = folder.text(&client.code);
    let stranger = Client { token: "f".repeat(64), ..client };
    for answer in [
        stranger.enter(),
        stranger.request("GET", "", ""),
        stranger.append(1, &lines()),
        stranger.withdraw(),
    ] {
        assert_eq!(answer.status, 401, "{answer:?}");
    }
    assert_eq!(folder.text(&stranger.code), text);
}

#[test]
fn other_paths_and_methods_reach_no_file() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let client = server.client(1);
    client.slot();
    let files = folder.files();
    let file = format!("/{}.jsonl", client.code);
    let (host, origin) =
        (format!("Host: {}", client.address), format!("Origin: http://{}", client.address));
    let token = format!("Authorization: Bearer {}", client.token);
    for path in [
        "/..",
        "/../study.toml",
        "/%2e%2e/study.toml",
        "/data",
        "/participants",
        "/participants/",
        "/participants/..",
        "/participants/..%2f..%2fstudy.toml",
        "/participants/%00",
        "/participants/lowercase1",
        "/participants/TESTCQDEAB/records",
        "/participants/TESTCQDEAB/records/-1",
        "/participants/TESTCQDEAB/records/+1",
        "/participants/TESTCQDEAB/records/1e3",
        "/participants/TESTCQDEAB/records/99999999999999999999999",
        "/participants/TESTCQDEAB/records/1/",
        "//participants/TESTCQDEAB",
        &file,
    ] {
        for method in ["GET", "PUT", "DELETE", "POST"] {
            let line = format!("{method} {path}");
            let answer = send(&server, &line, &[&host, &origin, &token]).expect("an answer");
            assert!(matches!(answer.status, 400 | 404 | 405), "{line}: {answer:?}");
            assert!(!answer.body.contains("completion_code"), "{line}");
        }
    }
    for line in ["POST /", "DELETE /", "PUT /", "OPTIONS /", "TRACE /", "PATCH /participants/AAAA"]
    {
        let answer = send(&server, line, &[&host, &origin, &token]).expect("an answer");
        assert!(matches!(answer.status, 404 | 405), "{line}: {answer:?}");
    }
    assert_eq!(folder.files(), files);
}

#[test]
fn malformed_and_broken_requests_store_nothing() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let client = server.client(1);
    client.slot();
    let text = folder.text(&client.code);
    let Client { address, code, token } = &client;
    let head = format!(
        "PUT /participants/{code}/records/1 HTTP/1.1\r\nHost: {address}\r\nOrigin: http://{address}\r\n\
         Authorization: Bearer {token}\r\nConnection: close\r\n"
    );
    let line = &lines()[0];
    let long = "x".repeat(100_000);
    let mut cases: Vec<Vec<u8>> = [
        "\r\nnonsense\r\n\r\n",
        "\u{0}\u{1}\u{2}",
        "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        "GET / HTTP/9.9\r\n\r\n",
        "GET /\r\n\r\n",
        &format!("GET / HTTP/1.1\r\nHost: {address}\r\nX: {long}\r\n\r\n"),
        &format!("GET /{long} HTTP/1.1\r\nHost: {address}\r\n\r\n"),
        &format!("{head}Content-Length: -1\r\n\r\n{line}"),
        &format!("{head}Content-Length: 5\r\nContent-Length: 9\r\n\r\n{line}"),
        &format!("{head}Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n{line}"),
        &format!("{head}Transfer-Encoding: chunked\r\n\r\nzz\r\n{line}\r\n0\r\n\r\n"),
        &format!("{head}Content-Length: {}\r\n\r\n{line}", MAX_BODY_BYTES + 1),
    ]
    .map(|case| case.as_bytes().to_vec())
    .into();
    cases.push([format!("{head}Content-Length: 3\r\n\r\n").as_bytes(), b"\xff\xfe\n"].concat());
    for case in cases {
        let answer = server.raw(&case);
        let status = answer.as_ref().map_or(400, |answer| answer.status);
        assert!((400..500).contains(&status), "{}: {answer:?}", String::from_utf8_lossy(&case));
        assert_eq!(folder.text(code), text);
    }
    // A tab that is closed in the middle of an upload: whole lines of an incomplete body are not stored.
    let half = format!("{head}Content-Length: {}\r\n\r\n{line}", line.len() * 2);
    let mut stream = std::net::TcpStream::connect(address).expect("it listens");
    std::io::Write::write_all(&mut stream, half.as_bytes()).expect("it reads");
    drop(stream);
    assert_eq!(client.append(1, &lines()).stored(), 8);
    assert_eq!(folder.text(code), text + &lines().concat());
}

#[test]
fn sizes_are_bounded() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let client = server.client(1);
    client.slot();
    let stored = client.append(1, &lines()[..2]).stored();
    let trace = |size: usize| {
        let text = "x".repeat(size);
        format!("{{\"type\":\"trace\",\"trial\":0,\"text\":\"{text}\"}}\n")
    };
    let request = |size: usize| client.append(stored as usize, &[trace(size)]);
    let answer = request(MAX_BODY_BYTES);
    assert_eq!(answer.status, 413);
    assert!(answer.error().contains("longer than 1048576 bytes"), "{}", answer.error());
    let mut from = stored as usize;
    let last = loop {
        let answer = client.append(from, &[trace(MAX_BODY_BYTES - 100)]);
        if answer.status != 200 {
            break answer;
        }
        from += 1;
    };
    assert_eq!(last.status, 413);
    assert_eq!(last.error(), "a participant has at most 16 MiB");
    assert_eq!(client.request("GET", "", "").stored(), from as u64);
    assert!(folder.text(&client.code).len() <= 16 << 20);
}

#[test]
fn rates_are_bounded() {
    let folder = Folder::new(&DEFINITION.replace("participants = 3", "participants = 1000"));
    let server = folder.server();
    let client = server.client(0);
    client.slot();
    let status = || client.request("GET", "", "").status;
    let n_answered = (0..PARTICIPANT_RATE.burst * 2).filter(|_| status() == 200).count();
    assert_eq!(n_answered as u64, PARTICIPANT_RATE.burst);
    let refused = client.append(1, &lines());
    assert_eq!((refused.status, refused.error().contains("too many requests")), (429, true));
    server.wait_secs(1);
    assert_eq!(client.append(1, &lines()).stored(), 8);

    server.wait_secs(1000);
    let entered = (1..=ENTRY_RATE.burst as usize + 5).map(|n| server.client(n).enter().status);
    let n_entered = entered.filter(|status| *status == 201).count();
    assert_eq!(n_entered as u64, ENTRY_RATE.burst);
    server.wait_secs(1);
    assert_eq!(server.client(ENTRY_RATE.burst as usize + 5).enter().status, 201);
}

#[test]
fn participants_who_never_finish_are_bounded() {
    let folder = Folder::new(&DEFINITION.replace("participants = 3", "participants = 2"));
    let server = folder.server();
    // Unused participants of a finished slot do not count for the other slot.
    let done = server.client(0);
    assert_eq!(done.slot(), 1);
    assert_eq!(done.append(1, &lines()).stored(), 8);
    for n in 1..11 {
        assert_eq!(server.client(n).slot(), 2);
        server.wait_secs(3600);
    }
    assert_eq!(server.client(11).enter().status, 410);
    assert!(!folder.files().contains(&format!("{}.jsonl", code(11))));
}
