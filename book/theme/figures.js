// The figures of the book: pictures that are compared, stepped through, and probed. Each works by pointer, by finger and by keyboard, and
// from a folder without a server.
"use strict";

const element = (name, properties = {}, children = []) => {
    const made = Object.assign(document.createElement(name), properties);
    made.append(...children);
    return made;
};

// Puts what a figure becomes where its pictures were, and keeps the caption.
function replace_pictures(figure, pictures, children) {
    const paragraphs = new Set(pictures.map((picture) => picture.closest("p")).filter(Boolean));
    figure.prepend(...children);
    paragraphs.forEach((paragraph) => paragraph.remove());
}

// Two pictures over one another, with a handle between them.
function make_compare(figure, pictures) {
    const [before, after] = pictures;
    const over = element("div", { className: "figure-over" }, [after]);
    const frame = element("div", { className: "figure-frame" }, [before, over]);
    const slider = element("input", { type: "range", min: 0, max: 100, step: 1, value: 50 });
    slider.setAttribute("aria-label", `From “${before.alt}” to “${after.alt}”`);
    const show = () => {
        // The handle's left side shows the first picture, and its right side the second.
        over.style.clipPath = `inset(0 0 0 ${slider.value}%)`;
        frame.style.setProperty("--at", `${slider.value}%`);
    };
    const follow = (event) => {
        const box = frame.getBoundingClientRect();
        slider.value = Math.round((100 * (event.clientX - box.left)) / box.width);
        show();
    };
    frame.addEventListener("pointerdown", (event) => {
        frame.setPointerCapture(event.pointerId);
        follow(event);
    });
    frame.addEventListener("pointermove", (event) => event.buttons && follow(event));
    slider.addEventListener("input", show);
    const names = element("div", { className: "figure-names" }, pictures.map((picture) => element("span", { textContent: picture.alt })));
    replace_pictures(figure, pictures, [frame, slider, names]);
    show();
}

// Pictures one after another, by a slider.
function make_steps(figure, pictures) {
    const frame = element("div", { className: "figure-frame" }, pictures);
    const slider = element("input", { type: "range", min: 0, max: pictures.length - 1, step: 1, value: 0 });
    slider.setAttribute("aria-label", "Step");
    const told = element("div", { className: "figure-told" });
    told.setAttribute("aria-live", "polite");
    const show = () => {
        const step = Number(slider.value);
        pictures.forEach((picture, index) => (picture.hidden = index !== step));
        told.textContent = `${step + 1} of ${pictures.length}: ${pictures[step].alt}`;
        slider.setAttribute("aria-valuetext", pictures[step].alt);
    };
    slider.addEventListener("input", show);
    replace_pictures(figure, pictures, [frame, slider, told]);
    show();
}

// Pictures side by side. A place that is pointed at is magnified in all of them.
const PROBED = 24;
function make_probe(figure, pictures) {
    let [x, y] = [0.5, 0.5];
    const cells = pictures.map((picture) => {
        const spot = element("div", { className: "figure-spot" });
        const frame = element("div", { className: "figure-frame", tabIndex: 0 }, [picture, spot]);
        frame.setAttribute("role", "application");
        frame.setAttribute("aria-label", `${picture.alt}: arrow keys move the magnified place`);
        const canvas = element("canvas", { width: PROBED, height: PROBED / 2 });
        return { picture, spot, frame, canvas };
    });
    const show = () => {
        for (const { picture, spot, canvas } of cells) {
            const [width, height] = [picture.naturalWidth, picture.naturalHeight];
            if (!width) {
                continue;
            }
            const left = Math.round(Math.min(Math.max(x * width - PROBED / 2, 0), width - PROBED));
            const top = Math.round(Math.min(Math.max(y * height - PROBED / 4, 0), height - PROBED / 2));
            const context = canvas.getContext("2d");
            context.imageSmoothingEnabled = false;
            context.drawImage(picture, left, top, PROBED, PROBED / 2, 0, 0, PROBED, PROBED / 2);
            const percent = (value, of) => `${(100 * value) / of}%`;
            Object.assign(spot.style, {
                left: percent(left, width),
                top: percent(top, height),
                width: percent(PROBED, width),
                height: percent(PROBED / 2, height),
            });
        }
    };
    const move = (to_x, to_y) => {
        [x, y] = [to_x, to_y].map((value) => Math.min(Math.max(value, 0), 1));
        show();
    };
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    for (const { picture, frame } of cells) {
        const point = (event) => {
            const box = frame.getBoundingClientRect();
            move((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
        };
        frame.addEventListener("pointermove", point);
        frame.addEventListener("pointerdown", point);
        frame.addEventListener("keydown", (event) => {
            const step = steps[event.key];
            if (step) {
                event.preventDefault();
                // Left and right turn pages otherwise.
                event.stopPropagation();
                move(x + (2 * step[0]) / (picture.naturalWidth || 1), y + (2 * step[1]) / (picture.naturalHeight || 1));
            }
        });
        picture.addEventListener("load", show);
    }
    const row = element("div", { className: "figure-row" }, cells.map(({ picture, frame, canvas }) =>
        element("div", { className: "figure-cell" }, [frame, canvas, element("span", { textContent: picture.alt })])));
    replace_pictures(figure, pictures, [row]);
    show();
}

const makers = { compare: make_compare, steps: make_steps, probe: make_probe };
for (const [name, make] of Object.entries(makers)) {
    for (const figure of document.querySelectorAll(`figure.${name}`)) {
        // mdBook puts a second copy of each picture behind it, to be shown large.
        const pictures = [...figure.querySelectorAll("img")].filter((picture) => !picture.closest(".img-wrapper"));
        if (pictures.length > 1) {
            make(figure, pictures);
        }
        // Arrow keys of a slider do not turn the page.
        figure.querySelectorAll("input").forEach((input) => input.addEventListener("keydown", (event) => event.stopPropagation()));
    }
}
