// Which parameters matter, by the needs of their declarations: {key, values, excluded}.

/// The text of a value as in declarations; empty for no value.
function textOf(value) { return value === null || value === undefined ? '' : String(value); }

function short(key) { return key.replace(/^(noise|arms|camera)\./, ''); }

/// Why a parameter does not matter, a short sentence; null where it does. `valueOf` gives the value
/// of a key.
export function uselessness(declared, valueOf) {
  for (const {key, values, excluded} of declared.needs ?? []) {
    if (values.includes(textOf(valueOf(key))) !== Boolean(excluded)) continue;
    if (key === 'arm') return 'Each [[arm]] has its own.';
    if (key === 'noise') return 'Needs noise, which is off.';
    if (key === 'arms.model' && excluded) return 'Needs arms: choose a model in Galaxy.';
    if (values[0] === '') return `Has no effect while ${short(key)} is given.`;
    const words = values.join(' or ');
    return excluded ? `Has no effect while ${short(key)} is ${words}.` : `Belongs to ${short(key)} ${words}.`;
  }
  return null;
}
