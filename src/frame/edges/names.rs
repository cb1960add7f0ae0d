//! The names of all dependencies.

use std::fmt;

macro_rules! rows {
    ($($name:literal => $row:ident),+ $(,)?) => {
        /// A dependency by its name.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[expect(missing_docs, reason = "rows say themselves why they are there")]
        pub enum RowName { $($row),+ }

        impl RowName {
            /// As `afterlight inspect` prints it.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$row => $name),+ }
            }
        }
    };
}

rows! {
    "upload-to-vertices" => UploadToVertices,
    "texture-to-copy" => TextureToCopy,
    "level-to-blit" => LevelToBlit,
    "blit-to-textures" => BlitToTextures,
    "upload-to-textures" => UploadToTextures,
    "shadow-atlas-to-clear" => ShadowAtlasToClear,
    "clear-to-shadow-maps" => ClearToShadowMaps,
    "shadow-map-reuse" => ShadowMapReuse,
    "shadow-map-to-lighting" => ShadowMapToLighting,
    "gbuffer-reuse" => GbufferReuse,
    "gbuffer-to-lighting" => GbufferToLighting,
    "hdr-reuse" => HdrReuse,
    "samples-reuse" => SamplesReuse,
    "output-reuse" => OutputReuse,
    "targets-reuse" => TargetsReuse,
    "lighting-to-transparent" => LightingToTransparent,
    "lighting-to-composite" => LightingToComposite,
    "sums-reuse" => SumsReuse,
    "sums-to-composite" => SumsToComposite,
    "hdr-to-tonemap" => HdrToTonemap,
    "forward-to-transparent" => ForwardToTransparent,
    "forward-to-composite" => ForwardToComposite,
    "output-to-fxaa" => OutputToFxaa,
    "picture-reuse" => PictureReuse,
    "read-back" => ReadBack,
    "gbuffer-to-tiled" => GbufferToTiled,
    "acquire" => Acquire,
    "present" => Present,
    "swapchain-to-present" => SwapchainToPresent,
    "present-to-swapchain" => PresentToSwapchain,
    "picture-to-split" => PictureToSplit,
    "split-to-picture" => SplitToPicture,
    "picture-to-copy" => PictureToCopy,
    "copy-to-picture" => CopyToPicture,
    "picture-to-overlay" => PictureToOverlay,
    "overlay-to-picture" => OverlayToPicture,
    "picture-to-encode" => PictureToEncode,
    "swapchain-to-encode" => SwapchainToEncode,
    "encode-to-picture" => EncodeToPicture,
    "encode-to-swapchain" => EncodeToSwapchain,
    "panel-to-copy" => PanelToCopy,
    "upload-to-panels" => UploadToPanels,
    "host-to-frame" => HostToFrame,
    "frame-to-host" => FrameToHost,
    "last-use-to-destroy" => LastUseToDestroy,
    "picture-to-host" => PictureToHost,
    "copy-to-host" => CopyToHost,
    "results-to-host" => ResultsToHost,
}

impl fmt::Display for RowName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
