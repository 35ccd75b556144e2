#include "nodes/vision/verb/calibration_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "common/image/image.h"
#include "common/plot/gnuplot.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using vision::Board;

/// A camera's pictures in the order of their names, and what their names begin with for all.
struct Listed {
  std::string from, prefix;
  std::vector<fs::path> files;
};

Listed files_of(const std::string& from) {
  std::error_code error;
  const bool folder = fs::is_directory(from, error);
  const fs::path where = folder ? fs::path(from) : fs::path(from).parent_path();
  Listed out{from, folder ? "" : fs::path(from).filename().string(), {}};
  for (const auto& entry : fs::directory_iterator(where.empty() ? "." : where, error)) {
    const std::string name = entry.path().filename().string();
    std::string ending = entry.path().extension().string();
    std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
    const bool picture = ending == ".png" || ending == ".jpg" || ending == ".jpeg";
    if (picture && name.starts_with(out.prefix)) out.files.push_back(entry.path());
  }
  if (error) throw ConfigError(from + ": " + error.message());
  if (out.files.empty()) throw ConfigError(from + ": no PNG or JPEG picture begins so");
  std::ranges::sort(out.files);
  return out;
}

/// A name in its words and numbers, in small letters: "imgLeft_007" is img, left, 7. Numbers have
/// no zeros before them, so that "7" and "007" are alike.
std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> out;
  char before = ' ';
  for (const char c : name) {
    const auto is = [](int (*kind)(int), char x) {
      return kind(static_cast<unsigned char>(x)) != 0;
    };
    const bool digit = is(std::isdigit, c), was_digit = is(std::isdigit, before);
    const bool starts = !is(std::isalnum, before) || digit != was_digit ||
                        (is(std::isupper, c) && !is(std::isupper, before));
    if (is(std::isalnum, c)) {
      if (starts) out.emplace_back();
      if (digit && out.back() == "0") out.back().clear();
      out.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    before = c;
  }
  return out;
}

/// 0: the words say that the picture is a left camera's, 1: a right one's; those words are taken
/// away, as is the number of a camera, whichever it is.
std::optional<int> take_side(std::vector<std::string>& words) {
  constexpr std::array<std::array<std::string_view, 2>, 2> kSides{{{"left", "l"}, {"right", "r"}}};
  for (std::size_t i = 0; i < words.size(); ++i) {
    for (int side = 0; side < 2; ++side) {
      const auto [whole, letter] = kSides.at(static_cast<std::size_t>(side));
      std::string& word = words[i];
      const bool at_end = word.size() > whole.size() && word.ends_with(whole),
                 at_begin = word.size() > whole.size() && word.starts_with(whole);
      if (word != whole && word != letter && !at_end && !at_begin) continue;
      if (at_end || at_begin) word.erase(at_begin ? 0 : word.size() - whole.size(), whole.size());
      if (!at_end && !at_begin) words.erase(words.begin() + static_cast<std::ptrdiff_t>(i));
      return side;
    }
    const bool camera = words[i] == "cam" || words[i] == "camera" || words[i] == "c";
    if (!camera || i + 1 == words.size() || words[i + 1].find_first_not_of("0123456789") == 0)
      continue;
    words.erase(words.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    return std::nullopt;
  }
  return std::nullopt;
}

/// Ways to tell by its name which pictures are of one instant, the strictest first.
enum class Telling {
  rest,   ///< what follows after the common beginning: left07, right07
  words,  ///< all but the side, whatever zeros stand before numbers: left_7, imgRight007
  number  ///< the last number
};

/// Key of a picture, empty if it has none.
std::string key_of(const fs::path& file, const Listed& camera, Telling telling) {
  if (telling == Telling::rest)
    return fs::path(file.filename().string().substr(camera.prefix.size())).stem().string();
  std::vector<std::string> words = words_of(file.stem().string());
  take_side(words);
  if (telling == Telling::words) return fmt::format("{}", fmt::join(words, " "));
  const auto number = std::ranges::find_if(words.rbegin(), words.rend(), [](const std::string& w) {
    return std::isdigit(static_cast<unsigned char>(w[0])) != 0;
  });
  return number == words.rend() ? std::string() : *number;
}

/// One folder for both cameras: each has the pictures that name its side.
void divide_by_side(std::vector<Listed>& cameras) {
  if (cameras.size() != 2 || cameras[0].files != cameras[1].files) return;
  for (int side = 0; side < 2; ++side) {
    std::erase_if(cameras[static_cast<std::size_t>(side)].files, [side](const fs::path& file) {
      std::vector<std::string> words = words_of(file.stem().string());
      return take_side(words) != side;
    });
    if (!cameras[static_cast<std::size_t>(side)].files.empty()) continue;
    throw ConfigError(fmt::format(
        "{}: both cameras' pictures are here, and none has '{}' in its name, as {} of pairs do",
        cameras[0].from, side == 0 ? "left" : "right",
        side == 0 ? "left07, 07_l" : "right07, 07_r"));
  }
}

/// The pictures of each camera by names that most pairs have in common; without any pair, by those
/// of the strictest way.
std::vector<NamedPictures> named_alike(const std::vector<Listed>& cameras,
                                       std::vector<vision::Rejected>& rejected) {
  std::vector<NamedPictures> best;
  std::vector<vision::Rejected> doubles;
  std::size_t most = 0;
  for (const auto telling : {Telling::rest, Telling::words, Telling::number}) {
    if (telling == Telling::number && most > 0) break;  // it may be of another series
    std::vector<NamedPictures> named(cameras.size());
    std::vector<vision::Rejected> same;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      for (const fs::path& file : cameras[c].files) {
        std::string key = key_of(file, cameras[c], telling);
        if (key.empty() && telling != Telling::rest) key = file.stem().string();
        const auto [at, fresh] = named[c].emplace(key, file);
        if (fresh) continue;
        same.push_back(
            {file.filename().string(), fmt::format("{} and {} are one picture by their names",
                                                   at->second.string(), file.string())});
      }
    }
    const auto pairs = static_cast<std::size_t>(
        std::ranges::count_if(named.front(), [&named](const NamedPictures::value_type& entry) {
          return std::ranges::all_of(
              named, [&entry](const NamedPictures& n) { return n.contains(entry.first); });
        }));
    if (!best.empty() && pairs <= most) continue;
    most = pairs;
    best = std::move(named);
    doubles = std::move(same);
  }
  rejected = std::move(doubles);
  return best;
}

/// Why a picture has no partner.
std::string alone(const fs::path& file, const NamedPictures& camera,
                  const std::vector<NamedPictures>& named) {
  const NamedPictures& other = &camera == &named[0] ? named[1] : named[0];
  return fmt::format(
      "{} has no partner: of the other camera's {} pictures, {} to {}, none differs "
      "from its name in the side alone",
      file.string(), other.size(), other.begin()->second.filename().string(),
      other.rbegin()->second.filename().string());
}

image::Image read_picture(const fs::path& file) {
  auto picture = image::read_image(file);
  if (!picture) throw ConfigError(picture.error().reason);
  return *std::move(picture);
}

/// Size of the board that most of up to six pictures show; a single opinion does not count.
std::optional<std::pair<int, int>> size_shown(const std::vector<fs::path>& files) {
  std::map<std::pair<int, int>, int> votes;
  const std::size_t step = std::max<std::size_t>(1, files.size() / 6);
  for (std::size_t i = 0; i < files.size(); i += step) {
    if (const auto size = vision::board_size_in(read_picture(files[i]))) ++votes[*size];
  }
  const auto most =
      std::ranges::max_element(votes, {}, [](const auto& vote) { return vote.second; });
  if (most == votes.end() || most->second < 2) return std::nullopt;
  return most->first;
}

/// A board of which only a part was asked for is found all the same, here another part than there.
void check_board_size(const Board& board, const std::vector<fs::path>& files, std::size_t found) {
  const auto shown = size_shown(files);
  const std::pair said(std::max(board.columns, board.rows), std::min(board.columns, board.rows));
  if (shown && *shown != said &&
      (2 * found < files.size() || shown->first > said.first || shown->second > said.second)) {
    throw ConfigError(fmt::format(
        "board: {} shows {}x{} inner corners, not {}x{}; count the corners at which four squares "
        "meet",
        files.front().string(), shown->first, shown->second, board.columns, board.rows));
  }
}

/// White squares where black ones are expected: the border of such a board is black, and no search
/// finds it.
void check_not_inverted(const Board& board, const std::vector<fs::path>& files) {
  for (const fs::path& file : files) {
    image::Image picture = read_picture(file);
    for (std::uint8_t& value : picture.bgr) value = static_cast<std::uint8_t>(255 - value);
    if (!vision::find_board(picture, board)) continue;
    // A part of a larger board has either colours.
    const auto whole = vision::board_size_in(picture);
    const std::pair said(std::max(board.columns, board.rows), std::min(board.columns, board.rows));
    if (whole != said) continue;
    throw ConfigError(
        fmt::format("board: {} shows it inverted, white for black: print it black on white, with a "
                    "white border",
                    file.string()));
  }
}

/// A position of the board, and why it is of no use.
struct Candidate {
  vision::Shot shot;
  std::vector<fs::path> files;
  std::vector<vision::PictureSize> sizes;
  std::string why;
};

/// The size that most pictures of a camera have is the camera's.
void keep_usual_sizes(std::vector<Candidate>& candidates, CalibrationPictures& out) {
  for (std::size_t c = 0; c < out.sizes.size(); ++c) {
    std::map<std::pair<int, int>, int> votes;
    for (const Candidate& each : candidates) ++votes[{each.sizes[c].width, each.sizes[c].height}];
    const auto most =
        std::ranges::max_element(votes, {}, [](const auto& vote) { return vote.second; });
    if (most == votes.end()) continue;
    out.sizes[c] = {most->first.first, most->first.second};
    for (Candidate& each : candidates) {
      const vision::PictureSize& size = each.sizes[c];
      if (size.width == out.sizes[c].width && size.height == out.sizes[c].height) continue;
      each.why = fmt::format(
          "{} has {}x{} pixels, most of this camera's {}x{}: give all pictures as the camera took "
          "them",
          each.files[c].string(), size.width, size.height, out.sizes[c].width, out.sizes[c].height);
    }
  }
}

cv::Mat view_of(image::Image& image) {
  return {image.height, image.width, CV_8UC3, image.bgr.data()};
}

image::Image rectify(const image::Rectification& turned, int side, const image::Image& picture) {
  image::Image source = picture, out(picture.width, picture.height);
  cv::Mat u(out.height, out.width, CV_32F), v(out.height, out.width, CV_32F);
  for (int row = 0; row < out.height; ++row) {
    for (int column = 0; column < out.width; ++column) {
      const Vector2d from = turned.original(side, {column, row});
      u.at<float>(row, column) = static_cast<float>(from.x());
      v.at<float>(row, column) = static_cast<float>(from.y());
    }
  }
  cv::Mat to = view_of(out);
  cv::remap(view_of(source), to, u, v, cv::INTER_LINEAR);
  return out;
}

}  // namespace

std::vector<NamedPictures> pictures_by_name(const std::vector<std::string>& from,
                                            std::vector<vision::Rejected>& rejected) {
  std::vector<Listed> cameras;
  for (const std::string& each : from) cameras.push_back(files_of(each));
  divide_by_side(cameras);
  std::vector<NamedPictures> named = named_alike(cameras, rejected);
  for (const NamedPictures& camera : named) {
    for (const auto& entry : camera) {
      const std::string& name = entry.first;  // clang 14 captures no structured bindings
      const bool whole =
          std::ranges::all_of(named, [&](const NamedPictures& n) { return n.contains(name); });
      const bool told =
          std::ranges::any_of(rejected, [&](const vision::Rejected& r) { return r.name == name; });
      if (!whole && !told) rejected.push_back({name, alone(entry.second, camera, named)});
    }
  }
  return named;
}

CalibrationPictures read_calibration_pictures(const Board& board,
                                              const std::vector<std::string>& from) {
  CalibrationPictures out;
  const std::vector<NamedPictures> named = pictures_by_name(from, out.rejected);
  out.sizes.resize(from.size());
  std::vector<fs::path> looked_at;
  std::size_t found = 0;
  std::vector<Candidate> candidates;
  for (const auto& [name, first_file] : named.front()) {
    Candidate shot{{name, {}}, {}, {}, {}};
    for (const NamedPictures& camera : named) {
      const auto it = camera.find(name);
      if (it == camera.end()) break;
      shot.files.push_back(it->second);
      const image::Image picture = read_picture(it->second);
      shot.sizes.push_back({picture.width, picture.height});
      looked_at.push_back(it->second);
      if (const auto seen = vision::find_board(picture, board)) {
        ++found;
        shot.shot.seen.push_back(seen->corners);
      } else if (shot.why.empty()) {
        shot.why = fmt::format("no whole board of {}x{} inner corners in {}", board.columns,
                               board.rows, it->second.string());
      }
    }
    // To search for a board that is not there takes a second per picture: not in all of them.
    constexpr std::size_t kDoubt = 4, kEnough = 10;
    if (found == 0 && looked_at.size() - shot.files.size() < kDoubt && looked_at.size() >= kDoubt) {
      check_board_size(board, looked_at, found);
      check_not_inverted(board, looked_at);
    }
    if (found == 0 && looked_at.size() >= kEnough) {
      throw ConfigError(
          fmt::format("board: no whole one of {}x{} inner corners in the first {} pictures, {} to "
                      "{}: it must be in view with its white border, sharp and lit evenly",
                      board.columns, board.rows, looked_at.size(), looked_at.front().string(),
                      looked_at.back().string()));
    }
    if (shot.files.size() == named.size()) candidates.push_back(std::move(shot));
  }
  keep_usual_sizes(candidates, out);
  for (Candidate& c : candidates) {
    if (!c.why.empty()) {
      out.rejected.push_back({c.shot.name, c.why});
      continue;
    }
    out.shots.push_back(std::move(c.shot));
    out.files.push_back(std::move(c.files));
  }
  if (found > 0 || looked_at.size() < 4) check_board_size(board, looked_at, found);
  return out;
}

image::Image corner_sheet(const Board& board, const CalibrationPictures& pictures) {
  constexpr int kColumns = 6, kTileWidth = 320;
  const auto cameras = static_cast<int>(pictures.sizes.size());
  const int tiles = cameras * static_cast<int>(pictures.shots.size());
  const int tile_height = kTileWidth * pictures.sizes[0].height / pictures.sizes[0].width;
  image::Image sheet(kColumns * kTileWidth, (tiles + kColumns - 1) / kColumns * tile_height);
  cv::Mat to = view_of(sheet);
  for (int i = 0; i < tiles; ++i) {
    const auto shot = static_cast<std::size_t>(i / cameras),
               c = static_cast<std::size_t>(i % cameras);
    image::Image picture = read_picture(pictures.files[shot][c]);
    std::vector<cv::Point2f> corners;
    for (const Vector2d& p : pictures.shots[shot].seen[c])
      corners.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
    cv::Mat view = view_of(picture);
    cv::drawChessboardCorners(view, cv::Size(board.columns, board.rows), corners, true);
    cv::putText(view, pictures.files[shot][c].stem().string(), {10, view.rows - 16},
                cv::FONT_HERSHEY_SIMPLEX, 1.2, cv::Scalar(0, 255, 255), 2, cv::LINE_AA);
    cv::Mat tile = to(
        cv::Rect(i % kColumns * kTileWidth, i / kColumns * tile_height, kTileWidth, tile_height));
    cv::resize(view, tile, tile.size(), 0.0, 0.0, cv::INTER_AREA);
  }
  return sheet;
}

image::Image rectified_pair(const image::Camera& left, const image::Camera& right,
                            const image::Image& left_picture, const image::Image& right_picture) {
  constexpr int kLines = 24;
  const image::Rectification turned(left, right);
  image::Image out(2 * left_picture.width, left_picture.height);
  cv::Mat to = view_of(out);
  int side = 0;
  for (const image::Image* picture : {&left_picture, &right_picture}) {
    image::Image half = rectify(turned, side, *picture);
    cv::Mat part =
        to(cv::Rect(side * left_picture.width, 0, left_picture.width, left_picture.height));
    cv::resize(view_of(half), part, part.size());
    ++side;
  }
  for (int v = kLines / 2; v < out.height; v += kLines) {
    cv::line(to, {0, v}, {out.width - 1, v},
             v / kLines % 2 == 0 ? cv::Scalar(0, 200, 0) : cv::Scalar(0, 160, 255));
  }
  return out;
}

void plot_calibration(const fs::path& png, const Board& board,
                      const vision::Calibrated& calibrated) {
  constexpr double kLonger = 100.0;
  constexpr std::array<const char*, 2> kWhich{"left", "right"};
  std::vector<plot::Data> data(calibrated.cameras.size());
  for (const vision::Shot& shot : calibrated.shots) {
    const auto pose = vision::locate_board(board, calibrated.cameras, shot.seen).X_FB;
    for (std::size_t c = 0; c < calibrated.cameras.size(); ++c) {
      for (std::size_t i = 0; i < board.size(); ++i) {
        const Vector2d at = shot.seen[c][i];
        const Vector2d off = at - calibrated.cameras[c].project(pose * board.point(i));
        data[c].rows.push_back({at.x(), at.y(), kLonger * off.x(), kLonger * off.y()});
      }
    }
  }
  std::string script = fmt::format("set multiplot layout 1,{}\n", data.size() + 1);
  for (std::size_t c = 0; c < data.size(); ++c) {
    const image::Lens& lens = calibrated.cameras[c].lens();
    data[c].name = kWhich.at(c);
    script += fmt::format(
        "set title '{}: residuals of corners, x {:g}'\nset xrange [0:{}]\nset yrange [{}:0]\n"
        "set size ratio -1\nset xlabel 'u [px]'\nset ylabel 'v [px]'\n"
        "plot ${} using 1:2:3:4 with vectors head size 4,20 lt 1 notitle\n",
        data.size() > 1 ? kWhich.at(c) : "camera", kLonger, lens.width_px, lens.height_px,
        kWhich.at(c));
  }
  plot::Data bars{"held", {}};
  std::string tics;
  for (std::size_t i = 0; i < calibrated.held_out.size(); ++i) {
    const vision::HeldOut& h = calibrated.held_out[i];
    bars.rows.push_back({static_cast<double>(i), h.reprojection_px, h.epipolar_px});
    tics += fmt::format("{}{} {}", i == 0 ? "" : ", ", plot::quoted(h.name), i);
  }
  data.push_back(bars);
  script += fmt::format(
      "set title 'each left out once'\nset size noratio\nset xrange [-1:{}]\nset yrange [0:*]\nset "
      "key above\n"
      "set xtics rotate ({})\nset xlabel 'position of the board'\nset ylabel 'error [px]'\nset "
      "style fill solid 0.5\n"
      "plot $held using ($1-0.2):2:(0.4) with boxes lt 1 title 'corners, rms'",
      bars.rows.size(), tics);
  if (calibrated.cameras.size() > 1)
    script +=
        ", $held using ($1+0.2):3:(0.4) with boxes lt 2 title 'epipolar lines, mean per side'";
  script += "\nunset multiplot";
  plot::plot_png(png, 520 * static_cast<int>(data.size()), 460, data, script);
}

}  // namespace mimesis::tool
