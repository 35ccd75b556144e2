#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mimesis::runtime {

// Keys of hosts (CURVE, Z85: 40 characters). Files in $XDG_CONFIG_HOME/mimesis (~/.config/mimesis):
// `key`, mode 0600: the public and the secret key of this host, a line each; `trusted`: KEY NAME in
// each line; /etc/mimesis/trusted counts as well.

struct KeyPair {
  std::string public_key, secret_key;
};

/// Nothing if there is no file. @throws ConfigError if others may read it or it holds no keys.
std::optional<KeyPair> own_key();
/// @throws ConfigError if there is one already and `replace` is false, or it cannot be written.
KeyPair make_key(bool replace);
/// Name by public key.
std::map<std::string, std::string> trusted_keys();
/// Takes trust back: from a name, or from a key. Returns the keys. @throws ConfigError if none is
/// trusted so, or it stands in /etc/mimesis/trusted, which the administrator writes.
std::vector<std::string> untrust_key(const std::string& name_or_key);
/// Adds or renames a key. @throws ConfigError unless `key` is a public key, or on a failed write.
void trust_key(const std::string& name, const std::string& key);

/// Begin of a tcp endpoint, to which ":PORT" is added; IPv6 addresses get their brackets.
std::string tcp_at(const std::string& address);
/// A tcp endpoint that is not in 127.0.0.0/8 or [::1]: what goes there needs keys.
bool leaves_host(const std::string& endpoint);

}  // namespace mimesis::runtime
