// The server's API: requests that bring the token, and errors that are one sentence.

const KEY = "fpmatch-token";
const TRIES = 6;

const given = new URLSearchParams(location.hash.slice(1)).get("token");
if (given) {
  sessionStorage.setItem(KEY, given);
  history.replaceState(null, "", location.pathname); // it shall not stay in sight
}

export function setToken(token) {
  sessionStorage.setItem(KEY, token);
}

export const hasToken = () => sessionStorage.getItem(KEY) !== null;

export class ApiError extends Error {
  constructor(status, sentence) {
    super(sentence);
    this.status = status;
  }
}

const pause = async (seconds, signal) => {
  await new Promise((resolve) => { setTimeout(resolve, seconds * 1000); });
  signal?.throwIfAborted();
};

export async function ask(path, fields = null, signal = undefined) {
  const token = sessionStorage.getItem(KEY);
  const headers = token ? { Authorization: `Bearer ${token}` } : {};
  const options = { headers, signal };
  if (fields !== null) {
    options.method = "POST";
    options.body = new FormData();
    for (const [name, value] of Object.entries(fields)) {
      if (value !== null && value !== undefined && value !== "") options.body.append(name, value);
    }
  }
  for (let attempt = 1; ; attempt += 1) {
    let answer;
    try {
      answer = await fetch(path, options);
    } catch (error) {
      if (error.name === "AbortError") throw error;
      throw new ApiError(0, "The server cannot be reached: it was stopped, or the file has gone.");
    }
    if (answer.ok) return answer;
    if (answer.status !== 503 || attempt === TRIES) {
      const { error } = await answer.json().catch(() => ({ error: `The server answered with status ${answer.status}.` }));
      throw new ApiError(answer.status, error);
    }
    await pause(Number(answer.headers.get("Retry-After")) || 2, signal);
  }
}
