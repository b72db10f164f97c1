//! Examples of the commands for contests.

use super::CommandExamples;

pub(super) const EXAMPLES: &[CommandExamples] = &[
    (
        "chaic submit",
        [
            ("Pack a submission", "chaic submit pack mine --out mine.tar"),
            ("Check it", "chaic submit check mine.tar"),
            ("Verify a score", "chaic submit verify results/mine"),
        ],
    ),
    (
        "chaic submit pack",
        [
            ("Pack a folder", "chaic submit pack mine --out mine.tar"),
            ("Print the digest as JSON", "chaic submit pack mine --out mine.tar --format json"),
            ("Check the folder first", "chaic submit check mine"),
        ],
    ),
    (
        "chaic submit check",
        [
            ("Check an archive", "chaic submit check mine.tar"),
            ("Check a folder before it is packed", "chaic submit check mine"),
            ("Print the checks as JSON", "chaic submit check mine.tar --format json"),
        ],
    ),
    (
        "chaic submit run",
        [
            (
                "Play a submission on a sealed split",
                "chaic submit run mine.tar --episodes sealed/episodes --out results/mine",
            ),
            (
                "Play rhp too, as the reference",
                "chaic submit run mine.tar --rhp --episodes sealed/episodes --out results/mine",
            ),
            (
                "Play with each partner of a list too",
                "chaic submit run mine.tar --episodes episodes --partners partners.json --out results/mine",
            ),
        ],
    ),
    (
        "chaic submit score",
        [
            ("Write score.json", "chaic submit score results/mine"),
            ("Write it elsewhere", "chaic submit score results/mine --out again.json"),
            ("Print a summary as JSON", "chaic submit score results/mine --format json"),
        ],
    ),
    (
        "chaic submit verify",
        [
            ("Verify a score", "chaic submit verify results/mine"),
            ("Name the score itself", "chaic submit verify results/mine/score.json"),
            (
                "Compare episodes and partners with the commitment too",
                "chaic submit verify results/mine --commitment commitment.json",
            ),
        ],
    ),
    (
        "chaic leaderboard",
        [
            ("Write a page of all scores", "chaic leaderboard build results --out page.html"),
            (
                "Refuse runs on other episodes or with another list of partners",
                "chaic leaderboard build results --commitment commitment.json --out page.html",
            ),
            ("Verify one score", "chaic submit verify results/mine"),
        ],
    ),
    (
        "chaic leaderboard build",
        [
            ("Write a page of all scores", "chaic leaderboard build results --out page.html"),
            (
                "Give it a title",
                "chaic leaderboard build results --title 'Spring contest' --out page.html",
            ),
            (
                "Print the refused submissions as JSON",
                "chaic leaderboard build results --out page.html --format json",
            ),
        ],
    ),
];
