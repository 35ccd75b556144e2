#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include "common/motion/mocap/skeleton.h"

namespace mimesis::mocap {

/// Walks over a text file that is in memory, word by word or line by line, and knows the line
/// number for messages. Blanks are space, tab, CR, vertical tab and form feed.
class TextScanner {
 public:
  /// Both are kept as views; `file` is named in errors.
  TextScanner(std::string_view text, std::string_view file) : text_(text), file_(file) {
    if (text_.substr(0, 3) == "\xEF\xBB\xBF") at_ = 3;  // byte order mark of UTF-8
  }

  /// Next word, over line ends; '{' and '}' are words of their own. Empty at the end of the file.
  std::string_view word();
  /// Next word on this line, empty at its end.
  std::string_view word_in_line();
  /// The rest of this line, trimmed, up to '{' if there is one.
  std::string_view rest_of_line();
  /// Goes to the next line that holds a word; false at the end of the file.
  bool next_line();
  /// To the end of this line.
  void skip_line();
  /// A finite number, the next word on this line or (`number`) of the file. @throws ConfigError
  double number_in_line();
  double number();
  long integer();

  /// Takes the next word and compares, letter case aside. @throws ConfigError
  void expect(std::string_view wanted);
  /// The next word is not taken.
  std::string_view peek();

  /// "file:line: what". Line of the word last taken. @throws ConfigError always
  [[noreturn]] void fail(const std::string& what) const;
  /// "file:line: found 'x', expected ..."; an empty word is the end of line or file.
  [[noreturn]] void fail_found(std::string_view found, const std::string& expected) const;

  int line() const { return line_; }
  std::size_t bytes_left() const { return text_.size() - at_; }
  std::size_t size() const { return text_.size(); }

 private:
  void skip_blanks();
  std::string_view take_word();
  double to_number(std::string_view word) const;

  std::string_view text_, file_;
  std::size_t at_ = 0;
  int line_ = 1;
};

/// Equal but for the case of ASCII letters.
bool same_word(std::string_view a, std::string_view b);

/// The whole file. @throws ConfigError if it cannot be read
std::string read_bytes(const std::string& file);
/// Writes the whole file. @throws ConfigError if it cannot be written
void write_bytes(const std::string& file, std::string_view bytes);
/// Without the folder.
std::string base_name(const std::string& file);

}  // namespace mimesis::mocap
