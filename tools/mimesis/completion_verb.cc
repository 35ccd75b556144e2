#include <CLI/CLI.hpp>
#include <iostream>
#include <map>

#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

// The scripts ask the program for every word, so that they know live names and new verbs. Where it
// has no answer the shell completes files.
constexpr const char* kBash =
    R"sh(# eval "$(mimesis completion bash)", or a file in /etc/bash_completion.d
_mimesis() {
  local IFS=$'\n'
  COMPREPLY=($("${COMP_WORDS[0]}" __complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null))
}
complete -o default -F _mimesis mimesis
)sh";

constexpr const char* kZsh = R"sh(#compdef mimesis
# eval "$(mimesis completion zsh)", or the file _mimesis in a folder of $fpath
_mimesis() {
  local -a found
  found=("${(@f)$("${words[1]}" __complete "${(@)words[2,CURRENT]}" 2>/dev/null)}")
  if [[ -n "${found[1]}" ]]; then compadd -a found; else _files; fi
}
compdef _mimesis mimesis
)sh";

constexpr const char* kFish =
    R"sh(# mimesis completion fish > ~/.config/fish/completions/mimesis.fish
function __mimesis_complete
    set -l words (commandline -opc) (commandline -ct)
    set -l found ($words[1] __complete $words[2..-1] 2>/dev/null)
    if test -n "$found"
        printf '%s\n' $found
    else
        __fish_complete_path (commandline -ct)
    end
end
complete -c mimesis -f -a '(__mimesis_complete)'
)sh";

}  // namespace

void add_completion(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("completion");
  auto shell = std::make_shared<std::string>();
  static const std::map<std::string, const char*> kScripts{
      {"bash", kBash}, {"zsh", kZsh}, {"fish", kFish}};
  verb->add_option("shell", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  verb->footer(
      "Completes verbs, options, and names of the running graph: topics, nodes, services, "
      "parameters.\n"
      "Examples:\n  eval \"$(mimesis completion bash)\"\n"
      "  mimesis completion fish > ~/.config/fish/completions/mimesis.fish");
  verb->callback([=, &exit_code] {
    std::cout << kScripts.at(*shell);
    exit_code = 0;
  });
}

}  // namespace mimesis::tool
