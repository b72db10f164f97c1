//! Environment variables of helper processes: an allow-list, and names that the user adds.
//!
//! The environment of the `chaic` process may hold API keys of language models and other credentials.
//! A helper process therefore starts with an empty environment, to which chaic adds only
//! variables of [`ALLOWED_VARIABLES`] and variables that the user names.

use std::ffi::OsString;

/// An environment variable that each helper process inherits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AllowedVariable {
    /// Name of the variable; a final `*` matches any suffix.
    pub name: &'static str,
    /// Reason why a helper needs it.
    pub reason: &'static str,
}

const fn allow(name: &'static str, reason: &'static str) -> AllowedVariable {
    AllowedVariable { name, reason }
}

/// Environment variables that each helper process inherits. None of them holds credentials by
/// convention: proxies, tokens and keys are absent on purpose.
pub const ALLOWED_VARIABLES: &[AllowedVariable] = &[
    allow("PATH", "finds the shell and the programs of the command"),
    allow("HOME", "locates packages and caches of the user"),
    allow("USER", "names the user where the system has no entry for them"),
    allow("LOGNAME", "names the user where the system has no entry for them"),
    allow("SHELL", "is read by programs that start a shell"),
    allow("LANG", "sets the text encoding"),
    allow("LANGUAGE", "sets the language of messages"),
    allow("LC_*", "sets the text encoding"),
    allow("TZ", "sets the time zone of log lines"),
    allow("TMPDIR", "locates temporary files"),
    allow("TMP", "locates temporary files (Windows)"),
    allow("TEMP", "locates temporary files (Windows)"),
    allow("SYSTEMROOT", "is required to start any program (Windows)"),
    allow("PATHEXT", "finds programs by their name (Windows)"),
    allow("PYTHONPATH", "locates Python modules"),
    allow("PYTHONHOME", "locates the Python installation"),
    allow("PYTHONUSERBASE", "locates Python packages of the user"),
    allow("PYTHONNOUSERSITE", "excludes Python packages of the user"),
    allow("PYTHONHASHSEED", "fixes the order of Python sets, so that runs repeat"),
    allow("PYTHONUNBUFFERED", "controls buffering of Python's output"),
    allow("PYTHONDONTWRITEBYTECODE", "keeps Python from writing bytecode files"),
    allow("PYTHONIOENCODING", "sets the text encoding of Python"),
    allow("PYTHONUTF8", "sets the text encoding of Python"),
    allow("VIRTUAL_ENV", "locates a Python virtual environment"),
    allow("CONDA_PREFIX", "locates a conda environment"),
    allow("CONDA_DEFAULT_ENV", "names a conda environment"),
    allow("PYENV_ROOT", "locates Python installations of pyenv"),
    allow("PYENV_VERSION", "selects a Python installation of pyenv"),
    allow("LD_LIBRARY_PATH", "locates shared libraries (Linux)"),
    allow("DYLD_LIBRARY_PATH", "locates shared libraries (macOS)"),
    allow("DYLD_FALLBACK_LIBRARY_PATH", "locates shared libraries (macOS)"),
    allow("CUDA_HOME", "locates the CUDA installation"),
    allow("CUDA_PATH", "locates the CUDA installation (Windows)"),
    allow("CUDA_VISIBLE_DEVICES", "selects graphics cards"),
    allow("CUBLAS_WORKSPACE_CONFIG", "makes cuBLAS deterministic"),
    allow("OMP_NUM_THREADS", "bounds threads of OpenMP"),
    allow("MKL_NUM_THREADS", "bounds threads of MKL"),
    allow("OPENBLAS_NUM_THREADS", "bounds threads of OpenBLAS"),
    allow("NUMEXPR_NUM_THREADS", "bounds threads of NumExpr"),
    allow("RAYON_NUM_THREADS", "bounds threads of rayon"),
    allow("RUST_BACKTRACE", "adds a backtrace to a panic"),
];

/// Returns whether each helper process inherits the variable of this name.
pub fn is_allowed(name: &str) -> bool {
    let same = |a: &str, b: &str| if cfg!(windows) { a.eq_ignore_ascii_case(b) } else { a == b };
    ALLOWED_VARIABLES.iter().any(|allowed| match allowed.name.strip_suffix('*') {
        Some(prefix) => name.get(..prefix.len()).is_some_and(|start| same(start, prefix)),
        None => same(name, allowed.name),
    })
}

/// Returns the variables of the current process that are allowed, or named in `added`.
pub(crate) fn inherited(added: &[String]) -> Vec<(OsString, OsString)> {
    let is_inherited = |name: &str| is_allowed(name) || added.iter().any(|added| added == name);
    std::env::vars_os().filter(|(name, _)| name.to_str().is_some_and(is_inherited)).collect()
}

/// Checks a name that the user adds to the allow-list.
///
/// # Errors
/// One line that says what a name may hold.
pub fn check_name(name: &str) -> Result<(), String> {
    if name.is_empty() || name.contains(|c: char| c == '=' || c.is_control()) {
        return Err(format!(
            "invalid variable name `{}`; write a name such as HF_HOME",
            name.escape_debug()
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_credentials_are_not_allowed() {
        let credentials = ["OPENAI_API_KEY", "HF_TOKEN", "AWS_SECRET_ACCESS_KEY", "HTTPS_PROXY"];
        let not_allowed = ["SSH_AUTH_SOCK", "PATH_TO_KEY", "LC", "PYTHONSTARTUP", "LD_PRELOAD", ""];
        for name in credentials.into_iter().chain(not_allowed) {
            assert!(!is_allowed(name), "{name}");
        }
        for name in ["PATH", "LC_ALL", "VIRTUAL_ENV"] {
            assert!(is_allowed(name), "{name}");
        }
        for allowed in ALLOWED_VARIABLES {
            for word in ["KEY", "TOKEN", "SECRET", "PASS", "PROXY", "CRED"] {
                assert!(!allowed.name.contains(word), "{}", allowed.name);
            }
            assert!(!allowed.reason.is_empty(), "{}", allowed.name);
        }
    }

    #[test]
    fn a_variable_name_has_no_value() {
        for wrong in ["", "A=b", "A\0", "A\n"] {
            assert!(check_name(wrong).unwrap_err().contains("write a name"), "{wrong:?}");
        }
        assert_eq!(check_name("HF_HOME"), Ok(()));
    }
}
